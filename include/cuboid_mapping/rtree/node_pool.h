// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/rtree/block_pool.h"
#include "cuboid_mapping/rtree/node.h"

namespace cuboid_mapping {

/// All nodes of one kind of level: leaves, or inner nodes.
///
/// Branches of leaves are changed through the pool, which gives a leaf the origin that its boxes
/// need, and makes it wide for as long as they extend over more than 255 voxels along an axis.
class NodePool {
 public:
  /// @param capacity  Most branches of a node, up to kMaxSlots. @param is_leaf  Kind of all nodes.
  NodePool(int capacity, bool is_leaf);

  /// A node without branches.
  [[nodiscard]] NodeIndex allocate();
  /// Takes a node back. @pre It is from allocate(), and has not been released since.
  void release(NodeIndex index);
  /// Releases all nodes.
  void clear() noexcept;

  /// The node, which stays where it is until it is released. @pre It is in use.
  ///@{
  [[nodiscard]] Node& operator[](NodeIndex index) {
    return *reinterpret_cast<Node*>(nodes_[index]);
  }
  [[nodiscard]] const Node& operator[](NodeIndex index) const {
    return *reinterpret_cast<const Node*>(nodes_[index]);
  }
  ///@}

  /// Asks the processor to fetch a node that is soon to be read.
  [[gnu::always_inline]] void prefetch(NodeIndex index) const { nodes_.prefetch(index); }

  /// Overwrites a branch (set), or adds one behind the last (append). @pre For append: !isFull().
  /// @complexity O(1); O(M) when a leaf changes its origin or kind, or is wide.
  ///@{
  void set(NodeIndex index, int slot, const Branch& branch);
  void append(NodeIndex index, const Branch& branch);
  ///@}
  /// The last branch takes the place of the removed one.
  void remove(NodeIndex index, int slot);

  /// Nodes in use.
  [[nodiscard]] std::size_t numNodes() const { return nodes_.numItems(); }
  /// Those of them that are NodeKind::kWideLeaf.
  [[nodiscard]] std::size_t numWideLeaves() const { return wide_boxes_.numItems(); }
  /// Bytes held from the allocator.
  [[nodiscard]] std::size_t numBytes() const { return nodes_.numBytes() + wide_boxes_.numBytes(); }

 private:
  void setKind(Node& leaf, NodeKind kind);
  void rewrite(Node& leaf, const Branch* branches, int count);

  int capacity_;
  bool is_leaf_;
  BlockPool nodes_;
  BlockPool wide_boxes_;
};

}  // namespace cuboid_mapping
