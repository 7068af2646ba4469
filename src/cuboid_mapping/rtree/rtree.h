// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/rtree/inner_tree.h"

#include <optional>
#include <vector>

namespace cuboid_mapping {

/// R-tree of cuboids (A. Guttman, "R-trees", 1984; paper, Section III): leaf nodes with d to M
/// cuboids under the nodes of an InnerTree.
///
/// Cuboids may overlap; none may be empty. Searches are in traversal.h.
/// Const functions may run side by side; a change needs exclusive access.
class RTree {
 public:
  /// @pre As for InnerTree.
  explicit RTree(const RTreeConfig& config = {}) : inner_(config), leaves_(config.max_branches) {}

  /// Reserves memory for changes, see InnerTree::reserve(). No change within it throws.
  void reserve(std::size_t num_insertions, std::size_t num_removals);
  /// Frees reserved memory that is not needed.
  void trim() noexcept;

  /// Inserts one cuboid. @pre Memory is reserved. @complexity As InnerTree::insert().
  void insertReserved(const Cuboid& cuboid) noexcept;
  /// Removes one cuboid with exactly this box. @pre Memory is reserved. @return false if there is
  /// none.
  bool removeReserved(const CellBox& box) noexcept;
  /// As above, but reserve memory first. @throws std::bad_alloc  The tree is unchanged then.
  ///@{
  void insert(const Cuboid& cuboid) {
    reserve(1, 0);
    insertReserved(cuboid);
  }
  bool remove(const CellBox& box) {
    reserve(0, 1);
    return removeReserved(box);
  }
  ///@}
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
  [[nodiscard]] std::size_t numLeafNodes() const { return leaves_.size(); }
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
  void insertBranch(const Branch& cuboid) noexcept;
  void splitLeaf(NodeIndex leaf, const Branch& extra) noexcept;

  InnerTree inner_;
  NodePool leaves_;
  std::size_t size_ = 0;
};

}  // namespace cuboid_mapping
