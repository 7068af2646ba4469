// SPDX-License-Identifier: BSD-3-Clause
// Searches of the cuboids of a map with a visitor. What they visit is what the R-tree holds after
// CuboidMap::fuse(), also before it: bricks that wait are divided on the way. Thread-safe beside each
// other, not beside a change.
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/rtree/traversal.h"

#include <queue>
#include <vector>

namespace cuboid_mapping {

namespace cuboid_search_detail {

/// Visits the cuboids of waiting bricks that share a cell with the window.
template <typename VisitorT>
void visitWaiting(const CuboidMap& map, const CellBox& window, CuboidFilter filter,
                  VisitorT& visit) {
  bool is_stopped = false;
  std::vector<Cuboid> cuboids;
  map.fusion().forEachWaiting(map.voxels(), window, [&](const VoxelBrick& brick) {
    if (is_stopped) return;
    cuboids.clear();
    map.fusion().divide(brick, cuboids);
    for (const Cuboid& cuboid : cuboids) {
      if (is_stopped || !matches(filter, cuboid) || !cuboid.box.intersects(window)) continue;
      is_stopped = visit(cuboid) == Visit::kStop;
    }
  });
}

}  // namespace cuboid_search_detail

/// Visits the cuboids that share a cell with the window, in no particular order.
/// @param visit  (const Cuboid&) -> Visit.
/// @complexity O(log n + k) for k cuboids in the window, and the bricks in it that wait.
template <typename VisitorT>
void visitBox(const CuboidMap& map, const CellBox& window, CuboidFilter filter, VisitorT visit) {
  if (window.isEmpty()) return;
  const Fusion& fusion = map.fusion();
  if (!fusion.isAnyWaiting()) return visitBox(fusion.tree(), window, filter, visit);
  bool is_stopped = false;
  visitBox(fusion.tree(), window, filter, [&](const Cuboid& cuboid) {
    if (fusion.isWaiting(brickOf(cuboid.box.min))) return Visit::kContinue;
    is_stopped = visit(cuboid) == Visit::kStop;
    return is_stopped ? Visit::kStop : Visit::kContinue;
  });
  if (!is_stopped) cuboid_search_detail::visitWaiting(map, window, filter, visit);
}

/// Visits all cuboids that pass the filter, in no particular order. @param visit  As in visitBox().
/// @complexity O(n); for kOccupied O(occupied cuboids and their siblings), and the bricks that wait.
template <typename VisitorT>
void visitAll(const CuboidMap& map, CuboidFilter filter, VisitorT visit) {
  if (!map.fusion().isAnyWaiting()) return visitAll(map.fusion().tree(), filter, visit);
  visitBox(map, kAllCells, filter, visit);
}

/// How many cuboids a map has.
struct CuboidCounts {
  std::size_t free = 0;      ///< Cuboids of free voxels.
  std::size_t occupied = 0;  ///< Cuboids of occupied voxels.

  /// Cuboids of both classes.
  [[nodiscard]] std::size_t total() const { return free + occupied; }
};

/// Counts the cuboids of a map, waiting bricks included. @complexity O(n).
[[nodiscard]] inline CuboidCounts countCuboids(const CuboidMap& map) {
  CuboidCounts counts;
  visitAll(map, CuboidFilter::kAll, [&counts](const Cuboid& cuboid) {
    ++(cuboid.isOccupied() ? counts.occupied : counts.free);
    return Visit::kContinue;
  });
  return counts;
}

/// Visits the cuboids by their distance from a point, nearest first.
///
/// @param point  In units of cells.
/// @param max_distance  Cuboids farther away are left out, in units of cells.
/// @param visit  (const Cuboid&, double distance in cells) -> Visit; the distance is 0 inside.
/// @complexity O((k + log n) log n) for k visited cuboids, and all bricks that wait.
template <typename VisitorT>
void visitNearest(const CuboidMap& map, const Eigen::Vector3d& point, double max_distance,
                  CuboidFilter filter, VisitorT visit) {
  struct Item {
    double distance;
    Cuboid cuboid;  ///< Or a brick that is not divided yet.
    bool is_brick;
    bool operator<(const Item& other) const { return distance > other.distance; }
  };
  const Fusion& fusion = map.fusion();
  std::priority_queue<Item> queue;
  const auto push = [&](const Cuboid& cuboid, bool is_brick) {
    const double distance = distanceTo(cuboid.box, point);
    if (distance <= max_distance) queue.push({distance, cuboid, is_brick});
  };
  fusion.forEachWaiting(map.voxels(), kAllCells, [&](const VoxelBrick& brick) {
    push({brickBox(brick.brick), {}}, true);
  });
  // Visits what waits up to a distance. @return Whether to go on.
  const auto visit_waiting = [&](double distance) {
    while (!queue.empty() && queue.top().distance <= distance) {
      const Item item = queue.top();
      queue.pop();
      if (!item.is_brick) {
        if (visit(item.cuboid, item.distance) == Visit::kStop) return Visit::kStop;
        continue;
      }
      std::vector<Cuboid> cuboids;
      const VoxelBrick* brick = map.voxels().findBrick(item.cuboid.box.min);
      fusion.divide(*brick, cuboids);
      for (const Cuboid& cuboid : cuboids) {
        if (matches(filter, cuboid)) push(cuboid, false);
      }
    }
    return Visit::kContinue;
  };
  bool is_stopped = false;
  visitNearest(fusion.tree(), point, max_distance, filter,
               [&](const Cuboid& cuboid, double distance) {
                 Visit answer = Visit::kContinue;
                 if (!fusion.isWaiting(brickOf(cuboid.box.min))) {
                   answer = visit_waiting(distance);
                   if (answer == Visit::kContinue) answer = visit(cuboid, distance);
                 }
                 is_stopped = answer == Visit::kStop;
                 return answer;
               });
  if (!is_stopped) (void)visit_waiting(max_distance);
}

}  // namespace cuboid_mapping
