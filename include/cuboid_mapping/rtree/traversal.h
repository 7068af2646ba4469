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

/// Part of a ray inside a box, as multiples of the direction; empty when first > last.
struct RayInterval {
  double first;
  double last;
};

/// Search of the boxes that a ray passes; see visitRay.
class RaySearch {
 public:
  RaySearch(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double t_end)
      : origin_(origin), direction_(direction), t_end_(t_end) {
    // Not infinite, so that a product with it is a number.
    constexpr double kGreatest = 1e300;
    for (int axis = 0; axis < 3; ++axis) {
      inverse_[axis] = std::clamp(1.0 / direction[axis], -kGreatest, kGreatest);
    }
  }

  [[nodiscard]] RayInterval intersect(const CellBox& box) const {
    RayInterval interval{0.0, t_end_};
    for (int axis = 0; axis < 3; ++axis) {
      const double lower = box.min[axis] - origin_[axis];
      const double upper = box.max[axis] - origin_[axis];
      if (direction_[axis] == 0.0) {
        if (lower > 0.0 || upper <= 0.0) return {1.0, 0.0};
        continue;
      }
      const double t_lower = lower / direction_[axis];
      const double t_upper = upper / direction_[axis];
      interval.first = std::max(interval.first, std::min(t_lower, t_upper));
      interval.last = std::min(interval.last, std::max(t_lower, t_upper));
    }
    return interval;
  }

  /// Where the ray enters a box; negative when it does not.
  [[nodiscard]] double keyOf(const CellBox& box) const {
    const RayInterval interval = intersect(box);
    return interval.first <= interval.last ? interval.first : -1.0;
  }

  /// Branches that the ray may pass; of those left out it touches at most the border.
  ///
  /// Without divisions and branches, so that the compiler turns the loops into SIMD instructions.
  [[nodiscard]] SlotSet findCandidates(const Node& node) const {
    const int end = paddedSlots(node.count());
    double t[kMaxSlots];
    double enter[kMaxSlots];
    double leave[kMaxSlots];
    for (int i = 0; i < end; ++i) enter[i] = 0.0;
    for (int i = 0; i < end; ++i) leave[i] = t_end_;
    for (int axis = 0; axis < 3; ++axis) {
      const double origin = origin_[axis];
      const double inverse = inverse_[axis];
      const bool is_rising = inverse > 0.0;
      node.getFaces(is_rising ? axis : axis + 3, t);
      for (int i = 0; i < end; ++i) enter[i] = std::max(enter[i], (t[i] - origin) * inverse);
      node.getFaces(is_rising ? axis + 3 : axis, t);
      for (int i = 0; i < end; ++i) leave[i] = std::min(leave[i], (t[i] - origin) * inverse);
    }
    return findSlots(node.count(), [&](int i) { return enter[i] <= leave[i]; });
  }

 private:
  Eigen::Vector3d origin_;
  Eigen::Vector3d direction_;
  Eigen::Vector3d inverse_;
  double t_end_;
};

/// Search of the boxes near a point, by squared distance; see visitNearest.
class NearestSearch {
 public:
  NearestSearch(const Eigen::Vector3d& point, double max_squared)
      : point_(point), max_squared_(max_squared) {}

  /// Squared distance of a box; negative when it is too great.
  [[nodiscard]] double keyOf(const CellBox& box) const {
    double squared = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
      const double outside =
          std::max({box.min[axis] - point_[axis], 0.0, point_[axis] - box.max[axis]});
      squared += outside * outside;
    }
    return squared <= max_squared_ ? squared : -1.0;
  }

  [[nodiscard]] static SlotSet findCandidates(const Node& node) { return node.allSlots(); }

 private:
  Eigen::Vector3d point_;
  double max_squared_;
};

/// Visits cuboids by a key that is never less for a cuboid than for the nodes above it.
/// @param search  RaySearch or NearestSearch.
template <typename SearchT, typename VisitorT>
void visitInOrder(const RTree& tree, CuboidFilter filter, const SearchT& search, VisitorT visit) {
  struct Item {
    double key;
    NodeIndex index;
    std::int16_t level;  ///< Of the node; -1: the cuboid in `slot` of leaf `index`.
    std::int16_t slot;
    bool operator<(const Item& other) const { return key > other.key; }
  };
  std::vector<Item> memory;
  memory.reserve(128);
  std::priority_queue<Item> queue(std::less<Item>(), std::move(memory));
  queue.push({0.0, tree.root(), static_cast<std::int16_t>(tree.height() - 1), 0});
  while (!queue.empty()) {
    const Item item = queue.top();
    queue.pop();
    if (item.level < 0) {
      if (visit(tree.node(0, item.index).cuboid(item.slot), item.key) == Visit::kStop) return;
      continue;
    }
    const Node& node = tree.node(item.level, item.index);
    SlotSet slots = search.findCandidates(node);
    if (filter != CuboidFilter::kAll) slots &= findMatching(node, filter);
    for (; slots != 0; slots = withoutFirst(slots)) {
      const int slot = firstSlot(slots);
      const double key = search.keyOf(node.box(slot));
      if (key < 0.0) continue;
      const bool is_leaf = item.level == 0;
      queue.push({key, is_leaf ? item.index : node.child()[slot],
                  static_cast<std::int16_t>(item.level - 1),
                  static_cast<std::int16_t>(is_leaf ? slot : 0)});
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
  const traversal_detail::RaySearch search(origin, direction, t_end);
  traversal_detail::visitInOrder(tree, filter, search, [&](const Cuboid& cuboid, double t_enter) {
    return visit(cuboid, t_enter, search.intersect(cuboid.box).last);
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
  const traversal_detail::NearestSearch search(point, max_distance * max_distance);
  traversal_detail::visitInOrder(tree, filter, search, [&](const Cuboid& cuboid, double squared) {
    return visit(cuboid, std::sqrt(squared));
  });
}

}  // namespace cuboid_mapping
