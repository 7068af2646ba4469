// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/geometry/grid.h"

#include <cassert>
#include <cmath>

namespace cuboid_mapping {
namespace {

/// Distance, in voxels, within which a face counts as lying on a voxel face.
constexpr double kFaceTolerance = 1e-6;

}  // namespace

Grid::Grid(double resolution_m)
    : resolution_m_(resolution_m), inverse_resolution_(1.0 / resolution_m) {
  assert(resolution_m > 0.0 && std::isfinite(resolution_m));
}

std::optional<CellBox> Grid::toCellBox(const MetricBox& box_map) const {
  CellBox box;
  for (int axis = 0; axis < 3; ++axis) {
    const double lower = box_map.min_m[axis] * inverse_resolution_;
    const double upper = box_map.max_m[axis] * inverse_resolution_;
    // Written so that NaN fails it.
    if (!(lower < upper && lower >= -kMaxCell && upper <= kMaxCell)) return std::nullopt;
    box.min[axis] = static_cast<std::int32_t>(std::floor(lower + kFaceTolerance));
    box.max[axis] = static_cast<std::int32_t>(std::ceil(upper - kFaceTolerance));
    if (box.max[axis] <= box.min[axis]) {
      box.min[axis] = static_cast<std::int32_t>(std::floor(lower));
      box.max[axis] = box.min[axis] + 1;
    }
  }
  return box;
}

std::optional<Cell> Grid::toSizeInCells(const Eigen::Vector3d& size_m) const {
  const auto box = toCellBox({Eigen::Vector3d::Zero(), size_m});
  if (!box) return std::nullopt;
  return box->size();
}

MetricBox Grid::toMetricBox(const CellBox& box) const {
  return {toMetres(toVector(box.min)), toMetres(toVector(box.max))};
}

Eigen::Vector3d Grid::centerOf(const CellBox& box) const {
  return toMetres(0.5 * (toVector(box.min) + toVector(box.max)));
}

}  // namespace cuboid_mapping
