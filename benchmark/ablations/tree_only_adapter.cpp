// SPDX-License-Identifier: BSD-3-Clause
#include "tree_only_adapter.h"

#include "cuboid_mapping/fusion/cuboid_tree.h"
#include "cuboid_mapping/map/cuboid_search.h"

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
double findNearest(const CuboidMap& map, NodeIndex index, int level, const CellRay& ray,
                   double nearest) {
  const Node& node = map.cuboids().inner().node(index);
  for (SlotSet slots = node.occupiedSlots(); slots != 0; slots = withoutFirst(slots)) {
    const int slot = firstSlot(slots);
    if (enter(ray, node.box(slot), nearest) >= nearest) continue;
    if (level > 1) {
      nearest = findNearest(map, node.child()[slot], level - 1, ray, nearest);
      continue;
    }
    visitBox(map, node.box(slot), CuboidFilter::kOccupied, [&](const Cuboid& cuboid) {
      nearest = std::min(nearest, enter(ray, cuboid.box, nearest));
      return Visit::kContinue;
    });
  }
  return nearest;
}

}  // namespace

double TreeOnlyAdapter::visitOccupied() const {
  double sum = 0.0;
  visitAll(map_, CuboidFilter::kOccupied, [&sum](const Cuboid& cuboid) {
    sum += cuboid.box.min.x;
    return Visit::kContinue;
  });
  return sum;
}

Occupancy TreeOnlyAdapter::classifyPoint(const Eigen::Vector3d& point_map) const {
  Occupancy occupancy = Occupancy::kUnknown;
  const auto cell = map_.grid().toCell(point_map);
  if (!cell) return occupancy;
  visitBox(map_, CellBox::ofCell(*cell), CuboidFilter::kAll, [&occupancy](const Cuboid& cuboid) {
    occupancy = cuboid.occupancy;
    return Visit::kStop;
  });
  return occupancy;
}

bool TreeOnlyAdapter::isAnyOccupied(const CellBox& box) const {
  bool is_any = false;
  visitBox(map_, box, CuboidFilter::kOccupied, [&is_any](const Cuboid&) {
    is_any = true;
    return Visit::kStop;
  });
  return is_any;
}

std::optional<double> TreeOnlyAdapter::castRay(const RayQuery& ray) const {
  const double resolution_m = map_.grid().resolution();
  const double range = kRayRange_m / resolution_m;
  const CellRay in_cells{ray.origin_map / resolution_m, ray.direction};
  const InnerTree& tree = map_.cuboids().inner();
  if (tree.height() < 2) return std::nullopt;  // A brick at the most.
  const double nearest = findNearest(map_, tree.root(), tree.height() - 1, in_cells, range);
  if (nearest >= range) return std::nullopt;
  return nearest * resolution_m;
}

}  // namespace cuboid_mapping::bench
