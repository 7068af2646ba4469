// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/corridor_boxes.h"

#include "cuboid_mapping/geometry/box_faces.h"

#include <algorithm>

namespace cuboid_mapping {
namespace {

/// Places of a way that cost as much as one brick.
constexpr std::size_t kPlacesPerBrick = 16;
/// Number of times that each point of the path is moved between its neighbours.
constexpr int kPulls = 50;

Eigen::Vector3d nearestIn(const MetricBox& box, const Eigen::Vector3d& point) {
  return point.cwiseMax(box.min_m).cwiseMin(box.max_m);
}

/// The point of a segment that is nearest to a box, roughly: projections back and forth.
Eigen::Vector3d findCrossing(const MetricBox& box, const Eigen::Vector3d& from,
                             const Eigen::Vector3d& to, Eigen::Vector3d point) {
  const Eigen::Vector3d way = to - from;
  const double squared = way.squaredNorm();
  if (squared == 0.0) return nearestIn(box, from);
  for (int i = 0; i < 4; ++i) {
    const double t = std::clamp((point - from).dot(way) / squared, 0.0, 1.0);
    point = nearestIn(box, from + t * way);
  }
  return point;
}

}  // namespace

/// The next slab beyond a face: one voxel, or all up to the region where no obstacle can be.
CellBox CorridorBoxes::nextSlab(const CellBox& box, int face) const {
  const int axis = face % 3;
  const CellBox rest = slabBeyond(
      box, face, face < 3 ? box.min[axis] - region_.min[axis] : region_.max[axis] - box.max[axis]);
  return rest.isEmpty() || !obstacles_.partWithAny(rest).isEmpty() ? slabBeyond(box, face) : rest;
}

/// Moves each face outwards, slab by slab in turn, until an obstacle or the region stops it.
CellBox CorridorBoxes::grow(CellBox box) const {
  bool is_moving[6] = {true, true, true, true, true, true};
  for (bool is_any = true; is_any;) {
    is_any = false;
    for (int face = 0; face < 6; ++face) {
      if (!is_moving[face]) continue;
      const CellBox slab = nextSlab(box, face);
      is_moving[face] = region_.contains(slab) && !obstacles_.isAny(slab);
      if (is_moving[face]) box = unite(box, slab);
      is_any = is_any || is_moving[face];
    }
  }
  return box;
}

std::vector<CellBox> CorridorBoxes::compute(const CellBox& start, const std::vector<Cell>& way,
                                            const CellBox& goal) const {
  std::vector<CellBox> boxes{grow(start)};
  for (std::size_t at = 0;;) {
    const CellBox places = field_.placesIn(boxes.back());
    while (at + 1 < way.size() && places.contains(way[at + 1])) ++at;
    if (field_.budget().spendAndUnlock(1 + way.size() / kPlacesPerBrick)) {
      for (std::size_t later = way.size() - 1; later > at; --later) {
        if (places.contains(way[later])) at = later;
      }
    }
    if (at + 1 == way.size()) break;
    boxes.push_back(
        grow(field_.coveredAt(unite(CellBox::ofCell(way[at]), CellBox::ofCell(way[at + 1])))));
  }
  if (!boxes.back().contains(goal)) boxes.push_back(grow(goal));
  if (!field_.budget().isSpent()) removeNeedless(boxes, start, goal);
  return boxes;
}

/// Removes boxes whose neighbours overlap enough without them.
void CorridorBoxes::removeNeedless(std::vector<CellBox>& boxes, const CellBox& start,
                                   const CellBox& goal) const {
  const auto connects = [&](const CellBox& a, const CellBox& b) {
    return !field_.placesIn(intersect(a, b)).isEmpty();
  };
  for (std::size_t i = 0; boxes.size() > 1 && i < boxes.size();) {
    const bool is_first = i == 0;
    const bool is_last = i + 1 == boxes.size();
    const bool is_needless =
        is_first ? boxes[1].contains(start)
                 : (is_last ? boxes[i - 1].contains(goal) : connects(boxes[i - 1], boxes[i + 1]));
    if (is_needless) {
      boxes.erase(boxes.begin() + static_cast<std::ptrdiff_t>(i));
    } else {
      ++i;
    }
  }
}

CorridorPortals findPortals(const Grid& grid, const std::vector<CellBox>& boxes, const Cell& size,
                            double clearance_m) {
  const Eigen::Vector3d half_m = 0.5 * grid.toMetres(Eigen::Vector3d(size.x, size.y, size.z));
  const Eigen::Vector3d wanted_m = half_m + Eigen::Vector3d(clearance_m, clearance_m, 0.0);
  CorridorPortals portals;
  for (std::size_t i = 1; i < boxes.size(); ++i) {
    const CellBox common = intersect(boxes[i - 1], boxes[i]);
    const MetricBox box = grid.toMetricBox(common);
    const Eigen::Vector3d center = grid.centerOf(common);
    portals.centers_map.push_back(center);
    portals.ranges_map.push_back(
        {(box.min_m + wanted_m).cwiseMin(center), (box.max_m - wanted_m).cwiseMax(center)});
  }
  return portals;
}

std::vector<Eigen::Vector3d> pullTight(const CorridorPortals& portals,
                                       const Eigen::Vector3d& start_map,
                                       const Eigen::Vector3d& goal_map) {
  std::vector<Eigen::Vector3d> path{start_map};
  path.insert(path.end(), portals.centers_map.begin(), portals.centers_map.end());
  path.push_back(goal_map);
  for (int pull = 0; pull < kPulls; ++pull) {
    for (std::size_t i = 1; i + 1 < path.size(); ++i) {
      path[i] = findCrossing(portals.ranges_map[i - 1], path[i - 1], path[i + 1], path[i]);
    }
  }
  return path;
}

}  // namespace cuboid_mapping
