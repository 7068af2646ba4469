// SPDX-License-Identifier: BSD-3-Clause
// The searches of an R-tree with leaf nodes of any kind. Thread-safe
// among each other, not beside a change.
#pragma once

#include "cuboid_mapping/occupancy/cuboid_filter.h"
#include "cuboid_mapping/rtree/inner_tree.h"

#include <Eigen/Core>

#include <cmath>
#include <limits>
#include <queue>
#include <vector>

namespace cuboid_mapping {

/// A window that contains every cuboid.
constexpr CellBox kEverywhere{
    {std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::min(),
     std::numeric_limits<std::int32_t>::min()},
    {std::numeric_limits<std::int32_t>::max(), std::numeric_limits<std::int32_t>::max(),
     std::numeric_limits<std::int32_t>::max()}};

namespace traversal_detail {

template <typename PrefetchT, typename VisitT>
Visit visitLeavesBelow(const InnerTree& tree, NodeIndex index, int level, const CellBox& window,
                       CuboidFilter filter, PrefetchT& prefetch_leaf, VisitT& visit_leaf) {
  const Node& node = tree.node(index);
  SlotSet slots = node.findOverlapping(window);
  if (filter == CuboidFilter::kOccupied) slots &= node.occupiedSlots();
  for (int stage = 0; stage < (level == 1 ? 2 : 1); ++stage) {
    for (SlotSet left = slots; left != 0; left = withoutFirst(left)) {
      const NodeIndex child = node.child()[firstSlot(left)];
      level == 1 ? prefetch_leaf(child, stage) : tree.prefetch(child);
    }
  }
  for (; slots != 0; slots = withoutFirst(slots)) {
    const NodeIndex child = node.child()[firstSlot(slots)];
    const Visit answer = level == 1 ? visit_leaf(child)
                                    : visitLeavesBelow(tree, child, level - 1, window, filter,
                                                       prefetch_leaf, visit_leaf);
    if (answer == Visit::kStop) return Visit::kStop;
  }
  return Visit::kContinue;
}

}  // namespace traversal_detail

/// Visits the leaf nodes whose MBRs share a cell with the window and which may hold cuboids that
/// pass the filter, in no particular order.
/// @param prefetch_leaf  (NodeIndex, int stage): called for some leaf nodes before they are visited, in stages
///                       0 and 1, so that the second can use data that the first has fetched.
/// @param visit_leaf  (NodeIndex) -> Visit.
template <typename PrefetchT, typename VisitT>
void visitLeaves(const InnerTree& tree, const CellBox& window, CuboidFilter filter,
                 PrefetchT prefetch_leaf, VisitT visit_leaf) {
  if (window.isEmpty() || tree.isEmpty()) return;
  if (tree.height() > 1) {
    traversal_detail::visitLeavesBelow(tree, tree.root(), tree.height() - 1, window, filter,
                                       prefetch_leaf, visit_leaf);
  } else if (tree.onlyLeaf().box.intersects(window)) {
    (void)visit_leaf(tree.root());
  }
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
/// @param read_leaf  (NodeIndex, push): calls push(const Cuboid&) for each cuboid of a leaf node
///                   that passes the filter.
/// @param visit  (const Cuboid&, double distance in cells) -> Visit; the distance is 0 inside.
template <typename ReadT, typename VisitT>
void visitNearest(const InnerTree& tree, const Eigen::Vector3d& point, double max_distance,
                  CuboidFilter filter, ReadT read_leaf, VisitT visit) {
  struct Item {
    double distance;
    Cuboid cuboid;    ///< Set if level is -1.
    NodeIndex index;  ///< Index of a node, otherwise.
    int level;
    bool operator<(const Item& other) const { return distance > other.distance; }
  };
  if (tree.isEmpty()) return;
  std::vector<Item> memory;
  memory.reserve(128);
  std::priority_queue<Item> queue(std::less<Item>(), std::move(memory));
  const auto push = [&](const CellBox& box, Item item) {
    item.distance = distanceTo(box, point);
    if (item.distance <= max_distance) queue.push(item);
  };
  push(*tree.bounds(), {0.0, {}, tree.root(), tree.height() - 1});
  while (!queue.empty()) {
    const Item item = queue.top();
    queue.pop();
    if (item.level < 0) {
      if (visit(item.cuboid, item.distance) == Visit::kStop) return;
    } else if (item.level == 0) {
      read_leaf(item.index, [&](const Cuboid& cuboid) {
        push(cuboid.box, {0.0, cuboid, kNoNode, -1});
      });
    } else {
      const Node& node = tree.node(item.index);
      SlotSet slots = filter == CuboidFilter::kOccupied ? node.occupiedSlots() : node.allSlots();
      for (; slots != 0; slots = withoutFirst(slots)) {
        const int slot = firstSlot(slots);
        push(node.box(slot), {0.0, {}, node.child()[slot], item.level - 1});
      }
    }
  }
}

}  // namespace cuboid_mapping
