// SPDX-License-Identifier: BSD-3-Clause
#include "tree_only_adapter.h"

#include "cuboid_mapping/rtree/traversal.h"

#include <algorithm>

namespace cuboid_mapping::bench {
namespace {

/// A ray in units of cells.
struct CellRay {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;
};

/// Where a ray enters a box, 0 inside; infinity when it does not before `end`.
double enter(const CellRay& ray, const CellBox& box, double end) {
  double first = 0.0;
  double last = end;
  for (int axis = 0; axis < 3; ++axis) {
    const double to_min = (box.min[axis] - ray.origin[axis]) / ray.direction[axis];
    const double to_max = (box.max[axis] - ray.origin[axis]) / ray.direction[axis];
    first = std::max(first, std::min(to_min, to_max));
    last = std::min(last, std::max(to_min, to_max));
  }
  return first < last ? first : std::numeric_limits<double>::infinity();
}

/// Distance of the first occupied cuboid below a node, at most `nearest`.
double findNearest(const RTree& tree, int level, NodeIndex index, const CellRay& ray,
                   double nearest) {
  const Node& node = tree.node(level, index);
  for (SlotSet slots = node.occupiedSlots(); slots != 0; slots = withoutFirst(slots)) {
    const int slot = firstSlot(slots);
    const double distance = enter(ray, node.box(slot), nearest);
    if (distance >= nearest) continue;
    nearest =
        level == 0 ? distance : findNearest(tree, level - 1, node.child()[slot], ray, nearest);
  }
  return nearest;
}

}  // namespace

double TreeOnlyAdapter::visitOccupied() const {
  double sum = 0.0;
  visitAll(tree_, CuboidFilter::kOccupied, [&sum](const Cuboid& cuboid) {
    sum += cuboid.box.min.x;
    return Visit::kContinue;
  });
  return sum;
}

Occupancy TreeOnlyAdapter::classifyPoint(const Eigen::Vector3d& point_map) const {
  Occupancy occupancy = Occupancy::kUnknown;
  const auto cell = grid_.toCell(point_map);
  if (!cell) return occupancy;
  visitCell(tree_, *cell, [&occupancy](const Cuboid& cuboid) {
    occupancy = cuboid.occupancy;
    return Visit::kStop;
  });
  return occupancy;
}

bool TreeOnlyAdapter::isAnyOccupied(const CellBox& box) const {
  bool is_any = false;
  visitBox(tree_, box, CuboidFilter::kOccupied, [&is_any](const Cuboid&) {
    is_any = true;
    return Visit::kStop;
  });
  return is_any;
}

std::optional<double> TreeOnlyAdapter::castRay(const RayQuery& ray) const {
  const double resolution_m = grid_.resolution();
  const double range = kRayRange_m / resolution_m;
  const CellRay in_cells{ray.origin_map / resolution_m, ray.direction};
  const double nearest = findNearest(tree_, tree_.height() - 1, tree_.root(), in_cells, range);
  if (nearest >= range) return std::nullopt;
  return nearest * resolution_m;
}

}  // namespace cuboid_mapping::bench
