// SPDX-License-Identifier: BSD-3-Clause
// Searches of an R-tree with a visitor. Thread-safe beside each other, not beside a change.
#pragma once

#include "cuboid_mapping/rtree/rtree.h"

#include <Eigen/Core>

#include <cmath>
#include <queue>
#include <vector>

namespace cuboid_mapping {

/// What a visitor answers: go on with the search, or end it.
enum class Visit : unsigned char { kContinue, kStop };

/// Which cuboids a search visits. For kOccupied, subtrees without any are skipped.
enum class CuboidFilter : unsigned char { kAll, kFree, kOccupied };

/// Whether a cuboid passes a filter.
[[nodiscard]] constexpr bool matches(CuboidFilter filter, const Cuboid& cuboid) {
  return filter == CuboidFilter::kAll || cuboid.isOccupied() == (filter == CuboidFilter::kOccupied);
}

namespace traversal_detail {

struct LevelNode {
  NodeIndex index;
  int level;
};

/// Branches that match a filter: cuboids, or children below which some may match.
[[nodiscard]] inline SlotSet findMatching(const Node& node, CuboidFilter filter) {
  if (filter == CuboidFilter::kOccupied) return node.occupiedSlots();
  if (filter == CuboidFilter::kFree && node.isLeaf()) {
    return node.allSlots() & ~node.occupiedSlots();
  }
  return node.allSlots();
}

/// Visits the places of the matching cuboids below a node that share a cell with the window.
template <typename VisitorT>
Visit visitLeafSlotsBelow(const RTree& tree, LevelNode at, const CellBox& window,
                          CuboidFilter filter, VisitorT& visit) {
  const Node& node = tree.node(at.level, at.index);
  SlotSet slots = node.findOverlapping(window);
  if (filter != CuboidFilter::kAll) slots &= findMatching(node, filter);
  if (at.level > 0) tree.prefetchChildren(at.level, node, slots);
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
  SlotSet slots = findMatching(node, filter);
  if (at.level > 0) tree.prefetchChildren(at.level, node, slots);
  for (; slots != 0; slots = withoutFirst(slots)) {
    const int slot = firstSlot(slots);
    const Visit answer =
        at.level == 0 ? visit(node.cuboid(slot))
                      : visitAllBelow(tree, {node.child()[slot], at.level - 1}, filter, visit);
    if (answer == Visit::kStop) return Visit::kStop;
  }
  return Visit::kContinue;
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

/// Distance of a point from a box, 0 inside; in units of cells.
[[nodiscard]] inline double distanceTo(const CellBox& box, const Eigen::Vector3d& point) {
  double squared = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double outside =
        std::max({box.min[axis] - point[axis], 0.0, point[axis] - box.max[axis]});
    squared += outside * outside;
  }
  return std::sqrt(squared);
}

/// Visits the cuboids by their distance from a point, nearest first.
///
/// @param point  In units of cells.
/// @param max_distance  Cuboids farther away are left out, in units of cells.
/// @param visit  (const Cuboid&, double distance in cells) -> Visit; the distance is 0 inside.
template <typename VisitorT>
void visitNearest(const RTree& tree, const Eigen::Vector3d& point, double max_distance,
                  CuboidFilter filter, VisitorT visit) {
  struct Item {
    double distance;
    NodeIndex index;
    std::int16_t level;  ///< Of the node; -1: the cuboid in `slot` of leaf `index`.
    std::int16_t slot;
    bool operator<(const Item& other) const { return distance > other.distance; }
  };
  std::vector<Item> memory;
  memory.reserve(128);
  std::priority_queue<Item> queue(std::less<Item>(), std::move(memory));
  queue.push({0.0, tree.root(), static_cast<std::int16_t>(tree.height() - 1), 0});
  while (!queue.empty()) {
    const Item item = queue.top();
    queue.pop();
    if (item.level < 0) {
      const Cuboid cuboid = tree.node(0, item.index).cuboid(item.slot);
      if (visit(cuboid, item.distance) == Visit::kStop) return;
      continue;
    }
    const Node& node = tree.node(item.level, item.index);
    SlotSet slots = traversal_detail::findMatching(node, filter);
    for (; slots != 0; slots = withoutFirst(slots)) {
      const int slot = firstSlot(slots);
      const double distance = distanceTo(node.box(slot), point);
      if (!(distance <= max_distance)) continue;
      const bool is_leaf = item.level == 0;
      queue.push({distance, is_leaf ? item.index : node.child()[slot],
                  static_cast<std::int16_t>(item.level - 1),
                  static_cast<std::int16_t>(is_leaf ? slot : 0)});
    }
  }
}

}  // namespace cuboid_mapping
