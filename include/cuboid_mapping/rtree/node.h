// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/occupancy/cuboid.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace cuboid_mapping {

/// Place of a node in the pool of its kind (leaves, or inner nodes).
using NodeIndex = std::uint32_t;
constexpr NodeIndex kNoNode = 0xFFFFFFFFU;

/// One branch of a node, gathered from the node's arrays.
///
/// A leaf branch is a cuboid: `value` is its log-odds. An inner branch is a child node: `box` is
/// its minimum bounding box (MBRC of the paper), `value` the greatest log-odds below it, which lets
/// a search for occupied cuboids skip it.
struct Branch {
  CellBox box;
  float value = 0.0F;
  NodeIndex child = kNoNode;  ///< Inner branches only.
};

/// Header of a node; its branches follow it in memory in struct-of-arrays order, so that one loop
/// tests all of them with SIMD instructions. Lives in a NodePool only.
class Node {
 public:
  Node(int capacity, bool is_leaf)
      : capacity_(static_cast<std::uint8_t>(capacity)), is_leaf_(is_leaf) {}
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  /// Bytes of a node with room for `capacity` branches.
  [[nodiscard]] static std::size_t numBytes(int capacity, bool is_leaf) {
    return sizeof(Node) + static_cast<std::size_t>(capacity) * (is_leaf ? 28 : 32);
  }

  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] bool isFull() const { return count_ == capacity_; }
  [[nodiscard]] bool isLeaf() const { return is_leaf_; }
  [[nodiscard]] const std::int32_t* min(int axis) const { return bounds() + axis * capacity_; }
  [[nodiscard]] const std::int32_t* max(int axis) const {
    return bounds() + (3 + axis) * capacity_;
  }
  [[nodiscard]] const float* value() const {
    return reinterpret_cast<const float*>(bounds() + 6 * capacity_);
  }
  [[nodiscard]] const NodeIndex* child() const {
    return reinterpret_cast<const NodeIndex*>(bounds() + 7 * capacity_);
  }

  [[nodiscard]] CellBox box(int slot) const {
    return {{min(0)[slot], min(1)[slot], min(2)[slot]}, {max(0)[slot], max(1)[slot], max(2)[slot]}};
  }
  [[nodiscard]] Cuboid cuboid(int slot) const { return {box(slot), value()[slot]}; }
  [[nodiscard]] Branch branch(int slot) const {
    return {box(slot), value()[slot], is_leaf_ ? kNoNode : child()[slot]};
  }

  /// Bounding box and greatest value of all branches. @pre count() > 0.
  [[nodiscard]] Branch summary() const;

  /// Slot of the branch to a child. @pre it is there.
  [[nodiscard]] int slotOf(NodeIndex child_index) const;

  void set(int slot, const Branch& branch);
  void append(const Branch& branch) { set(count_++, branch); }
  /// The last branch takes the place of the removed one.
  void remove(int slot);
  void clear() { count_ = 0; }

  NodeIndex parent = kNoNode;

 private:
  [[nodiscard]] const std::int32_t* bounds() const {
    return reinterpret_cast<const std::int32_t*>(this + 1);
  }

  std::uint16_t count_ = 0;
  std::uint8_t capacity_;
  bool is_leaf_;
};

/// All nodes of one kind, in blocks that never move, addressed by 32-bit indices.
class NodePool {
 public:
  NodePool(int capacity, bool is_leaf);

  [[nodiscard]] NodeIndex allocate();
  void release(NodeIndex index);
  void clear();

  [[nodiscard]] Node& operator[](NodeIndex index) { return *address(index); }
  [[nodiscard]] const Node& operator[](NodeIndex index) const { return *address(index); }

  [[nodiscard]] std::size_t numNodes() const { return num_allocated_ - free_.size(); }
  /// Bytes held from the allocator.
  [[nodiscard]] std::size_t numBytes() const;

 private:
  static constexpr unsigned kBlockBits = 6;
  static constexpr NodeIndex kBlockNodes = 1U << kBlockBits;

  [[nodiscard]] Node* address(NodeIndex index) const {
    return reinterpret_cast<Node*>(blocks_[index >> kBlockBits].get() +
                                   (index & (kBlockNodes - 1)) * node_bytes_);
  }

  int capacity_;
  bool is_leaf_;
  std::size_t node_bytes_;
  std::vector<std::unique_ptr<std::byte[]>> blocks_;
  std::vector<NodeIndex> free_;
  std::size_t num_allocated_ = 0;
};

}  // namespace cuboid_mapping
