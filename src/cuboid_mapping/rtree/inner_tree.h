// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/rtree/node.h"
#include "cuboid_mapping/rtree/rtree_config.h"

#include <array>
#include <optional>
#include <vector>

namespace cuboid_mapping {

/// The inner nodes of an R-tree of order (d, M), above leaf nodes that the owner keeps (A.
/// Guttman, "R-trees", 1984; paper, Section III): height balanced, insertion by least expansion,
/// quadratic split, removal with condensing and re-insertion.
///
/// A leaf node is a number; its branch has the MBR of its content. A single leaf node is the
/// root. Const functions may run side by side; a change needs exclusive access.
class InnerTree {
 public:
  /// @pre 2 <= max_branches <= 64 and 1 <= min_branches <= max_branches / 2. With d = 1 the height has no bound: for small
  /// trees only.
  explicit InnerTree(const RTreeConfig& config);

  /// Reserves memory for changes: this many insertions and removals of leaf nodes with numbers
  /// below `end_leaf`. Changes within it need no memory. @throws std::bad_alloc  Nothing has changed.
  void reserve(std::size_t num_insertions, std::size_t num_removals, std::size_t end_leaf);
  /// Frees reserved memory that is not needed.
  void trim() noexcept { nodes_.trim(); }

  /// Adds a leaf node by least expansion. @pre It is not in the tree. @complexity O(M log n), a split O(M^2).
  void insert(const Branch& leaf) noexcept;
  /// Adds a leaf node that was split off `leaf` to the parent of `leaf`. @complexity As insert().
  void insertBeside(NodeIndex leaf, const Branch& sibling) noexcept;
  /// Updates the MBRs above a leaf node whose content has changed. @complexity O(M log n).
  void update(const Branch& leaf) noexcept;
  /// Removes a leaf node, and condenses. @pre It is in the tree.
  /// @complexity O(M log n); O(M^2 log^2 n) if nodes of all levels are condensed.
  void remove(NodeIndex leaf) noexcept;

  /// Whether there is no leaf node.
  [[nodiscard]] bool isEmpty() const { return height_ == 0; }
  /// The leaf node that a box expands least. @pre !isEmpty(). @complexity O(M log n).
  [[nodiscard]] NodeIndex chooseLeaf(const CellBox& box) const;
  /// MBR of all leaf nodes; nothing if there is none. @complexity O(M).
  [[nodiscard]] std::optional<CellBox> bounds() const;

  /// Levels: 0 without a leaf node, 1 when it is the only one. Leaf nodes are at level 0.
  [[nodiscard]] int height() const { return height_; }
  /// An inner node, at level height() - 1; the leaf node while height() is 1. @pre !isEmpty().
  [[nodiscard]] NodeIndex root() const { return height_ == 1 ? only_leaf_.child : root_; }
  /// An inner node.
  [[nodiscard]] const Node& node(NodeIndex index) const { return nodes_[index]; }
  /// The inner node above a leaf node; kNoNode if the leaf node is the root.
  [[nodiscard]] NodeIndex parentOf(NodeIndex leaf) const {
    return leaf < leaf_parents_.size() ? leaf_parents_[leaf] : kNoNode;
  }
  /// Prefetches an inner node.
  [[gnu::always_inline]] void prefetch(NodeIndex index) const { nodes_.prefetch(index); }
  /// The only leaf node while height() is 1.
  [[nodiscard]] const Branch& onlyLeaf() const { return only_leaf_; }

  /// Number of inner nodes.
  [[nodiscard]] std::size_t size() const { return nodes_.numItems(); }
  /// Configuration of the constructor.
  [[nodiscard]] const RTreeConfig& config() const { return config_; }
  /// Bytes held from the allocator.
  [[nodiscard]] std::size_t numBytes() const {
    return nodes_.numBytes() + leaf_parents_.capacity() * sizeof(NodeIndex);
  }

 private:
  [[nodiscard]] NodeIndex chooseNode(const CellBox& box, int level) const;
  void append(NodeIndex index, int level, const Branch& branch);
  void fill(NodeIndex index, int level, const Branch* begin, const Branch* end);
  NodeIndex makeNode(int level);
  void releaseNode(NodeIndex index, int level);
  void addBranch(NodeIndex index, int level, const Branch& branch);
  void split(NodeIndex index, int level, const Branch& extra);
  void growRoot(const Branch& first, const Branch& second);
  void updateAncestors(NodeIndex index);
  void removeBranch(NodeIndex index, int level, int slot);
  void shrinkRoot();
  [[nodiscard]] Branch summaryOf(NodeIndex index) const;

  static constexpr std::size_t kMaxLevels = 33;  ///< For 2^32 leaf nodes, d = 2.

  RTreeConfig config_;
  NodePool nodes_;
  std::vector<NodeIndex> leaf_parents_;                ///< By leaf node; kNoNode for others.
  std::array<std::uint32_t, kMaxLevels> num_nodes_{};  ///< Numbers by level.
  Branch only_leaf_;                                   ///< The root while height_ is 1.
  NodeIndex root_ = kNoNode;                           ///< The root while height_ is 2 or more.
  int height_ = 0;
};

}  // namespace cuboid_mapping
