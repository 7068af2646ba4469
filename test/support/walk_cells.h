// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/scan/ray_walk.h"

#include <optional>
#include <vector>

namespace cuboid_mapping::test {

/// A cursor of walkRay that records the cells.
class CellCursor {
 public:
  CellCursor(const Ray& ray, std::vector<Cell>& cells) : ray_(&ray), cells_(&cells) {
    cell_ = ray.start;
  }

  void mark() { cells_->push_back(cell_); }
  void advance(int axis) { cell_[axis] += ray_->step[axis]; }
  [[nodiscard]] bool isAtEnd() const { return cell_ == ray_->end; }

 private:
  const Ray* ray_;
  std::vector<Cell>* cells_;
  Cell cell_;
};

/// One ray; nothing if one of its ends is outside the grid or not finite.
inline std::optional<Ray> computeRay(const Grid& grid, const Eigen::Vector3d& anchor_map,
                                     const Eigen::Vector3f& origin, const Eigen::Vector3f& end) {
  const RayOrigin ray_origin(grid, anchor_map, origin);
  Ray ray;
  if (!ray_origin.cell() || !ray_origin.computeRay(end, ray)) return std::nullopt;
  return ray;
}

/// The cells that walkRay marks, in order.
inline std::vector<Cell> walkCells(const Ray& ray) {
  std::vector<Cell> cells;
  (void)walkRay(ray, CellCursor(ray, cells));
  return cells;
}

}  // namespace cuboid_mapping::test
