// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/grid.h"
#include "cuboid_mapping/scan/brick_update.h"
#include "cuboid_mapping/scan/scan.h"
#include "cuboid_mapping/voxels/brick_table.h"

#include <Eigen/Core>

#include <cstddef>

namespace cuboid_mapping {

/// Bricks of a map that are rebuilt while the others stay: cuts clouds down to them.
///
/// Const functions may run side by side.
class BrickRegion {
 public:
  /// Adds the bricks that a cloud touches.
  void add(const ScanUpdate& update);
  /// Adds the bricks that share a cell with a box.
  void add(const CellBox& box);

  [[nodiscard]] bool contains(const Cell& brick) const { return bricks_.find(brick) != nullptr; }
  [[nodiscard]] std::size_t size() const { return bricks_.size(); }

  /// Whether a brick may lie within a distance from a place. @complexity O(1).
  [[nodiscard]] bool isNear(const Grid& grid, const Eigen::Vector3d& place_map,
                            double distance_m) const;
  /// Removes beams that cannot touch a brick. @param scan  Placed in the map. @complexity O(beams).
  void cut(const Grid& grid, Scan& scan) const;
  /// Removes other bricks from an update.
  void cut(ScanUpdate& update) const;

 private:
  struct Item {
    Cell brick{};
  };

  void add(const Cell& brick);
  [[nodiscard]] MetricBox bounds(const Grid& grid) const;

  BrickTable<Item> bricks_;
  CellBox bounds_{};
};

}  // namespace cuboid_mapping
