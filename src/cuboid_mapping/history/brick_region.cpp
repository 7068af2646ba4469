// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/history/brick_region.h"

#include <algorithm>
#include <vector>

namespace cuboid_mapping {
namespace {

/// Whether the line between two points shares a point with a box.
bool crosses(const MetricBox& box, const Eigen::Vector3d& start, const Eigen::Vector3d& end) {
  double enter = 0.0;
  double leave = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double length = end[axis] - start[axis];
    const double to_min = box.min_m[axis] - start[axis];
    const double to_max = box.max_m[axis] - start[axis];
    if (length == 0.0) {
      if (to_min > 0.0 || to_max < 0.0) return false;
      continue;
    }
    enter = std::max(enter, std::min(to_min / length, to_max / length));
    leave = std::min(leave, std::max(to_min / length, to_max / length));
  }
  return enter <= leave;
}

}  // namespace

void BrickRegion::add(const Cell& brick) {
  bricks_.findOrAdd(brick);
  bounds_ = bounds_.isEmpty() ? brickBox(brick) : unite(bounds_, brickBox(brick));
}

void BrickRegion::add(const ScanUpdate& update) {
  for (const BrickUpdate& brick : update.bricks) add(brick.brick);
}

void BrickRegion::add(const CellBox& box) {
  forEachBrick(box, [this](const Cell& brick) { add(brick); });
}

/// Adds a margin of a voxel for the rounding of float32.
MetricBox BrickRegion::bounds(const Grid& grid) const {
  const Cell voxel{1, 1, 1};
  return grid.toMetricBox({bounds_.min - voxel, bounds_.max + voxel});
}

bool BrickRegion::isNear(const Grid& grid, const Eigen::Vector3d& place_map,
                         double distance_m) const {
  if (bounds_.isEmpty()) return false;
  const MetricBox box = bounds(grid);
  return (place_map.cwiseMax(box.min_m).cwiseMin(box.max_m) - place_map).norm() <= distance_m;
}

void BrickRegion::cut(const Grid& grid, Scan& scan) const {
  MetricBox box = bounds(grid);
  box.min_m -= scan.anchor_map;
  box.max_m -= scan.anchor_map;
  const Eigen::Vector3d origin = scan.origin.cast<double>();
  const auto passes_by = [&](const Eigen::Vector3f& end) {
    return !crosses(box, origin, end.cast<double>());
  };
  for (auto* ends : {&scan.points, &scan.no_returns, &scan.open_ends, &scan.free_points}) {
    ends->erase(std::remove_if(ends->begin(), ends->end(), passes_by), ends->end());
  }
}

void BrickRegion::cut(ScanUpdate& update) const {
  std::vector<BrickUpdate>& bricks = update.bricks;
  bricks.erase(std::remove_if(bricks.begin(), bricks.end(),
                              [this](const BrickUpdate& brick) { return !contains(brick.brick); }),
               bricks.end());
}

}  // namespace cuboid_mapping
