// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/rtree/quadratic_split.h"
#include "cuboid_mapping/rtree/traversal.h"

#include <cassert>
#include <optional>

namespace cuboid_mapping::bench {

/// R-tree of cuboids (A. Guttman, "R-trees", 1984; paper, Section III): leaf nodes with d to M
/// cuboids under the nodes of an InnerTree. The leaf nodes of the product's tree are bricks; this is the tree of the
/// paper's Figure 7 (a).
///
/// Cuboids may overlap; none may be empty.
/// Const functions may run side by side; a change needs exclusive access.
class RTree {
 public:
  /// @pre As for InnerTree.
  explicit RTree(const RTreeConfig& config = {}) : inner_(config), leaves_(config.max_branches) {}

  /// Frees memory that is not needed.
  void trim() noexcept;

  /// Inserts one cuboid. @throws std::bad_alloc  @complexity As InnerTree::insert().
  void insert(const Cuboid& cuboid);
  /// Removes one cuboid with exactly this box. @return false if there is none. @throws std::bad_alloc
  bool remove(const CellBox& box);
  /// Replaces a cuboid with this box, in the same leaf node. @return false if
  /// there is none.
  bool replace(const CellBox& box, const Cuboid& cuboid) noexcept;
  /// Removes all cuboids.
  void clear() noexcept;

  /// Number of cuboids.
  [[nodiscard]] std::size_t size() const { return size_; }
  /// Whether there is no cuboid; there is no node then.
  [[nodiscard]] bool isEmpty() const { return size_ == 0; }
  /// Minimum bounding box of all cuboids; nothing when there are none.
  [[nodiscard]] std::optional<CellBox> bounds() const { return inner_.bounds(); }
  /// Levels, leaf nodes included; 0 for an empty tree.
  [[nodiscard]] int height() const { return inner_.height(); }
  /// The nodes above the leaf nodes.
  [[nodiscard]] const InnerTree& inner() const { return inner_; }
  /// A leaf node; its branches are cuboids.
  [[nodiscard]] const Node& leaf(NodeIndex index) const { return leaves_[index]; }
  /// Prefetches a leaf node.
  [[gnu::always_inline]] void prefetchLeaf(NodeIndex index) const { leaves_.prefetch(index); }
  /// Number of leaf nodes.
  [[nodiscard]] std::size_t numLeafNodes() const { return leaves_.numItems(); }
  /// Bytes held from the allocator for the nodes.
  [[nodiscard]] std::size_t numBytes() const { return inner_.numBytes() + leaves_.numBytes(); }

 private:
  /// Place of a cuboid.
  struct LeafSlot {
    NodeIndex leaf;
    int slot;
  };
  [[nodiscard]] std::optional<LeafSlot> find(const CellBox& box) const;
  [[nodiscard]] Branch summaryOf(NodeIndex leaf) const;
  void insertBranch(const Branch& cuboid);
  void splitLeaf(NodeIndex leaf, const Branch& extra);

  InnerTree inner_;
  NodePool leaves_;
  std::size_t size_ = 0;
};

/// Visits the places of the cuboids that share a cell with the window, in no particular order.
/// @param visit  (NodeIndex leaf, int slot) -> Visit.
template <typename VisitT>
void visitLeafSlots(const RTree& tree, const CellBox& window, CuboidFilter filter, VisitT visit) {
  visitLeaves(
      tree.inner(), window, filter,
      [&tree](NodeIndex leaf, int stage) {
        if (stage == 0) tree.prefetchLeaf(leaf);
      },
      [&](NodeIndex index) {
        const Node& leaf = tree.leaf(index);
        SlotSet slots = leaf.findOverlapping(window);
        if (filter == CuboidFilter::kOccupied) slots &= leaf.occupiedSlots();
        if (filter == CuboidFilter::kFree) slots &= ~leaf.occupiedSlots();
        for (; slots != 0; slots = withoutFirst(slots)) {
          if (visit(index, firstSlot(slots)) == Visit::kStop) return Visit::kStop;
        }
        return Visit::kContinue;
      });
}

/// Visits the cuboids that share a cell with the window, in no particular order.
/// @param visit  (const Cuboid&) -> Visit.
template <typename VisitT>
void visitBox(const RTree& tree, const CellBox& window, CuboidFilter filter, VisitT visit) {
  visitLeafSlots(tree, window, filter,
                 [&](NodeIndex leaf, int slot) { return visit(tree.leaf(leaf).cuboid(slot)); });
}

/// Visits the cuboids that hold a cell: at most one where cuboids are disjoint.
template <typename VisitT>
void visitCell(const RTree& tree, const Cell& cell, VisitT visit) {
  visitBox(tree, CellBox::ofCell(cell), CuboidFilter::kAll, visit);
}

/// Visits all cuboids that pass the filter, in no particular order. @param visit  As in visitBox().
template <typename VisitT>
void visitAll(const RTree& tree, CuboidFilter filter, VisitT visit) {
  visitBox(tree, kEverywhere, filter, visit);
}

/// Visits the cuboids of a tree by their distance from a point, see above.
template <typename VisitT>
void visitNearest(const RTree& tree, const Eigen::Vector3d& point, double max_distance,
                  CuboidFilter filter, VisitT visit) {
  const auto read_leaf = [&](NodeIndex index, const auto& push) {
    const Node& leaf = tree.leaf(index);
    for (int slot = 0; slot < leaf.count(); ++slot) {
      if (matches(filter, leaf.cuboid(slot))) push(leaf.cuboid(slot));
    }
  };
  cuboid_mapping::visitNearest(tree.inner(), point, max_distance, filter, read_leaf, visit);
}

inline void RTree::trim() noexcept {
  leaves_.trim();
  inner_.trim();
}

inline void RTree::insert(const Cuboid& cuboid) {
  assert(!cuboid.box.isEmpty());
  insertBranch({cuboid.box, cuboid.isOccupied(), kNoNode});
  ++size_;
}

inline bool RTree::remove(const CellBox& box) {
  const auto found = find(box);
  if (!found) return false;
  --size_;
  Node& leaf = leaves_[found->leaf];
  leaf.remove(found->slot);
  const bool is_root = inner_.height() == 1;
  if (leaf.count() >= (is_root ? 1 : inner_.config().min_branches)) {
    inner_.update(summaryOf(found->leaf));
    return true;
  }
  BranchList orphans;
  for (int slot = 0; slot < leaf.count(); ++slot) orphans.push(leaf.branch(slot));
  inner_.reserve(0, 1, leaves_.endIndex());
  inner_.remove(found->leaf);
  leaves_.release(found->leaf);
  for (const Branch& orphan : orphans) insertBranch(orphan);
  return true;
}

inline bool RTree::replace(const CellBox& box, const Cuboid& cuboid) noexcept {
  const auto found = find(box);
  if (!found) return false;
  leaves_[found->leaf].set(found->slot, {cuboid.box, cuboid.isOccupied(), kNoNode});
  inner_.update(summaryOf(found->leaf));
  return true;
}

inline void RTree::clear() noexcept { *this = RTree(inner_.config()); }

inline std::optional<RTree::LeafSlot> RTree::find(const CellBox& box) const {
  std::optional<LeafSlot> found;
  visitLeafSlots(*this, CellBox::ofCell(box.min), CuboidFilter::kAll,
                 [&](NodeIndex leaf, int slot) {
                   if (leaves_[leaf].box(slot) != box) return Visit::kContinue;
                   found = LeafSlot{leaf, slot};
                   return Visit::kStop;
                 });
  return found;
}

inline Branch RTree::summaryOf(NodeIndex leaf) const {
  Branch branch = leaves_[leaf].summary();
  branch.child = leaf;
  return branch;
}

inline void RTree::insertBranch(const Branch& cuboid) {
  leaves_.reserve(1);
  inner_.reserve(1, 0, leaves_.endIndex());
  if (inner_.isEmpty()) {
    const NodeIndex root = leaves_.allocate();
    leaves_[root].append(cuboid);
    inner_.insert(summaryOf(root));
    return;
  }
  const NodeIndex leaf = inner_.chooseLeaf(cuboid.box);
  if (leaves_[leaf].isFull()) return splitLeaf(leaf, cuboid);
  leaves_[leaf].append(cuboid);
  inner_.update(summaryOf(leaf));
}

inline void RTree::splitLeaf(NodeIndex leaf, const Branch& extra) {
  BranchList branches;
  for (int slot = 0; slot < leaves_[leaf].count(); ++slot) {
    branches.push(leaves_[leaf].branch(slot));
  }
  branches.push(extra);
  const SplitGroups groups = splitQuadratic(branches, inner_.config().min_branches);
  const NodeIndex sibling = leaves_.allocate();
  leaves_[leaf].clear();
  for (const Branch& branch : groups.first) leaves_[leaf].append(branch);
  for (const Branch& branch : groups.second) leaves_[sibling].append(branch);
  inner_.update(summaryOf(leaf));
  inner_.insertBeside(leaf, summaryOf(sibling));
}

}  // namespace cuboid_mapping::bench
