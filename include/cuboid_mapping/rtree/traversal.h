// SPDX-License-Identifier: BSD-3-Clause
// Searches of an R-tree with a visitor. Thread-safe beside each other, not beside a change.
#pragma once

#include "cuboid_mapping/rtree/rtree.h"

#include <Eigen/Core>

#include <cmath>
#include <limits>
#include <queue>
#include <vector>

namespace cuboid_mapping {

/// What a visitor answers: go on with the search, or end it.
enum class Visit : unsigned char { kContinue, kStop };

/// Which cuboids a search visits. For kOccupied, subtrees without any are skipped.
enum class CuboidFilter : unsigned char { kAll, kFree, kOccupied };

/// Whether a cuboid of this log-odds passes a filter.
[[nodiscard]] inline bool matches(CuboidFilter filter, float log_odds) {
  return filter == CuboidFilter::kAll ||
         (classify(log_odds) == Occupancy::kOccupied) == (filter == CuboidFilter::kOccupied);
}

namespace traversal_detail {

struct LevelNode {
  NodeIndex index;
  int level;
};

/// Branches that match a filter: cuboids, or children below which some may match.
[[nodiscard]] inline SlotSet findMatching(const Node& node, CuboidFilter filter) {
  if (filter == CuboidFilter::kOccupied) return node.findOccupied();
  if (filter == CuboidFilter::kFree && node.isLeaf()) return node.allSlots() & ~node.findOccupied();
  return node.allSlots();
}

/// Visits the places of the matching cuboids below a node that share a cell with the window.
template <typename VisitorT>
Visit visitLeafSlotsBelow(const RTree& tree, LevelNode at, const CellBox& window,
                          CuboidFilter filter, VisitorT& visit) {
  const Node& node = tree.node(at.level, at.index);
  SlotSet slots = node.findOverlapping(window);
  if (filter != CuboidFilter::kAll) slots &= findMatching(node, filter);
  for (; slots != 0; slots = withoutFirst(slots)) {
    const int slot = firstSlot(slots);
    const Visit answer =
        at.level == 0
            ? visit(at.index, slot)
            : visitLeafSlotsBelow(tree, {node.child()[slot], at.level - 1}, window, filter, visit);
    if (answer == Visit::kStop) return Visit::kStop;
  }
  return Visit::kContinue;
}

/// Visits the matching cuboids below a node.
template <typename VisitorT>
Visit visitAllBelow(const RTree& tree, LevelNode at, CuboidFilter filter, VisitorT& visit) {
  const Node& node = tree.node(at.level, at.index);
  for (SlotSet slots = findMatching(node, filter); slots != 0; slots = withoutFirst(slots)) {
    const int slot = firstSlot(slots);
    const Visit answer =
        at.level == 0 ? visit(node.cuboid(slot))
                      : visitAllBelow(tree, {node.child()[slot], at.level - 1}, filter, visit);
    if (answer == Visit::kStop) return Visit::kStop;
  }
  return Visit::kContinue;
}

/// Part of a ray inside a box, as multiples of the direction; empty when first > last.
struct RayInterval {
  double first;
  double last;
};

[[nodiscard]] inline RayInterval intersectRay(const Eigen::Vector3d& origin,
                                              const Eigen::Vector3d& direction, double t_end,
                                              const CellBox& box) {
  RayInterval interval{0.0, t_end};
  for (int axis = 0; axis < 3; ++axis) {
    const double lower = box.min[axis] - origin[axis];
    const double upper = box.max[axis] - origin[axis];
    if (direction[axis] == 0.0) {
      if (lower > 0.0 || upper <= 0.0) return {1.0, 0.0};
      continue;
    }
    const double t_lower = lower / direction[axis];
    const double t_upper = upper / direction[axis];
    interval.first = std::max(interval.first, std::min(t_lower, t_upper));
    interval.last = std::min(interval.last, std::max(t_lower, t_upper));
  }
  return interval;
}

[[nodiscard]] inline double squaredDistance(const Eigen::Vector3d& point, const CellBox& box) {
  double sum = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double outside =
        std::max({box.min[axis] - point[axis], 0.0, point[axis] - box.max[axis]});
    sum += outside * outside;
  }
  return sum;
}

/// Visits cuboids by a key that is never less for a cuboid than for the nodes above it.
/// @param key_of  CellBox -> key; a negative one leaves the branch out.
template <typename KeyT, typename VisitorT>
void visitInOrder(const RTree& tree, CuboidFilter filter, KeyT key_of, VisitorT visit) {
  struct Item {
    double key;
    NodeIndex index;
    int level;  ///< Of the node; -1: the cuboid in `slot` of leaf `index`.
    int slot;
    bool operator<(const Item& other) const { return key > other.key; }
  };
  std::priority_queue<Item> queue;
  queue.push({0.0, tree.root(), tree.height() - 1, 0});
  while (!queue.empty()) {
    const Item item = queue.top();
    queue.pop();
    if (item.level < 0) {
      if (visit(tree.node(0, item.index).cuboid(item.slot), item.key) == Visit::kStop) return;
      continue;
    }
    const Node& node = tree.node(item.level, item.index);
    for (SlotSet slots = findMatching(node, filter); slots != 0; slots = withoutFirst(slots)) {
      const int slot = firstSlot(slots);
      const double key = key_of(node.box(slot));
      if (key < 0.0) continue;
      queue.push(item.level == 0 ? Item{key, item.index, -1, slot}
                                 : Item{key, node.child()[slot], item.level - 1, 0});
    }
  }
}

}  // namespace traversal_detail

/// Visits the places of the cuboids that share a cell with the window, in no particular order.
/// @param visit  (NodeIndex leaf, int slot) -> Visit.
template <typename VisitorT>
void visitLeafSlots(const RTree& tree, const CellBox& window, CuboidFilter filter, VisitorT visit) {
  if (window.isEmpty()) return;
  traversal_detail::visitLeafSlotsBelow(tree, {tree.root(), tree.height() - 1}, window, filter,
                                        visit);
}

/// Visits the cuboids that share a cell with the window, in no particular order.
/// @param visit  (const Cuboid&) -> Visit.
template <typename VisitorT>
void visitBox(const RTree& tree, const CellBox& window, CuboidFilter filter, VisitorT visit) {
  visitLeafSlots(tree, window, filter,
                 [&](NodeIndex leaf, int slot) { return visit(tree.node(0, leaf).cuboid(slot)); });
}

/// Visits the cuboids that hold a cell: at most one where cuboids are disjoint.
template <typename VisitorT>
void visitCell(const RTree& tree, const Cell& cell, VisitorT visit) {
  visitBox(tree, CellBox::ofCell(cell), CuboidFilter::kAll, visit);
}

/// Visits all cuboids that pass the filter, in no particular order. @param visit as in visitBox.
/// @complexity O(n); for kOccupied O(occupied cuboids and their siblings).
template <typename VisitorT>
void visitAll(const RTree& tree, CuboidFilter filter, VisitorT visit) {
  traversal_detail::visitAllBelow(tree, {tree.root(), tree.height() - 1}, filter, visit);
}

/// Visits the cuboids that a ray passes, in the order in which it enters them.
///
/// A cuboid that the ray only touches in a face, an edge or a corner is visited, too, with an
/// interval of (nearly) no length.
///
/// @param origin, direction  In units of cells; the direction need not be normalized.
/// @param t_end  End of the ray, as a multiple of the direction.
/// @param visit  (const Cuboid&, double t_enter, double t_leave) -> Visit.
template <typename VisitorT>
void visitRay(const RTree& tree, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
              double t_end, CuboidFilter filter, VisitorT visit) {
  const auto interval_of = [&](const CellBox& box) {
    return traversal_detail::intersectRay(origin, direction, t_end, box);
  };
  traversal_detail::visitInOrder(
      tree, filter,
      [&](const CellBox& box) {
        const traversal_detail::RayInterval interval = interval_of(box);
        return interval.first <= interval.last ? interval.first : -1.0;
      },
      [&](const Cuboid& cuboid, double t_enter) {
        return visit(cuboid, t_enter, interval_of(cuboid.box).last);
      });
}

/// Visits the cuboids by their distance from a point, nearest first.
///
/// @param point  In units of cells.
/// @param max_distance  Cuboids farther away are left out, in units of cells.
/// @param visit  (const Cuboid&, double distance in cells) -> Visit; the distance is 0 inside.
template <typename VisitorT>
void visitNearest(const RTree& tree, const Eigen::Vector3d& point, double max_distance,
                  CuboidFilter filter, VisitorT visit) {
  const double max_squared = max_distance * max_distance;
  traversal_detail::visitInOrder(
      tree, filter,
      [&](const CellBox& box) {
        const double squared = traversal_detail::squaredDistance(point, box);
        return squared <= max_squared ? squared : -1.0;
      },
      [&](const Cuboid& cuboid, double squared) { return visit(cuboid, std::sqrt(squared)); });
}

}  // namespace cuboid_mapping
