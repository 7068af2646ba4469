// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/occupancy/cuboid.h"
#include "cuboid_mapping/rtree/block_pool.h"
#include "cuboid_mapping/rtree/slot_set.h"

#include <cstddef>
#include <cstdint>

namespace cuboid_mapping {

/// Index of a node: an inner node of its tree, or a leaf node; each kind has its own numbers.
using NodeIndex = std::uint32_t;
/// Index that no node has.
constexpr NodeIndex kNoNode = 0xFFFFFFFFU;

/// One branch of a node, gathered from the node's arrays.
///
/// A leaf branch is a cuboid, occupied or free. An inner branch is a child node: `box` is its
/// minimum bounding box (MBRC of the paper). Searches for occupied cuboids skip branches without
/// any.
struct Branch {
  CellBox box;                ///< Not empty.
  bool has_occupied = false;  ///< The cuboid is occupied, or one below the child is.
  NodeIndex child = kNoNode;  ///< Child of an inner branch.
};

/// Header of a node; its branches follow it in memory in struct-of-arrays order, so that one loop
/// tests all of them with SIMD instructions. Lives in a NodePool only.
class Node {
 public:
  /// A node without branches. @pre It lies in numBytes(capacity) bytes, capacity <= kMaxSlots.
  explicit Node(int capacity) : capacity_(static_cast<std::uint8_t>(capacity)) {}
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  /// Bytes of a node with room for `capacity` branches.
  [[nodiscard]] static std::size_t numBytes(int capacity);

  /// Number of branches; they are in slots 0 to count() - 1.
  [[nodiscard]] int count() const { return count_; }
  /// Whether the node has the maximum number of branches (M of the paper).
  [[nodiscard]] bool isFull() const { return count_ == capacity_; }
  /// The slots of all branches.
  [[nodiscard]] SlotSet allSlots() const { return firstSlots(count_); }
  /// The branches that are occupied cuboids, or have one below.
  [[nodiscard]] SlotSet occupiedSlots() const { return occupied_ & allSlots(); }
  /// The branches that share a cell with the window. @pre It is not empty.
  [[nodiscard]] SlotSet findOverlapping(const CellBox& window) const;

  /// The child of each branch, by slot; undefined in leaf nodes.
  [[nodiscard]] const NodeIndex* child() const {
    return reinterpret_cast<const NodeIndex*>(coordinates() + 6 * stride());
  }
  /// Least cells (min) and ends (max, excluded) of the boxes along an axis, by slot.
  ///@{
  [[nodiscard]] const std::int32_t* min(int axis) const {
    return coordinates() + static_cast<std::size_t>(axis) * stride();
  }
  [[nodiscard]] const std::int32_t* max(int axis) const { return min(axis + 3); }
  ///@}

  /// Box of a branch: a cuboid, or the MBR of a child.
  [[nodiscard]] CellBox box(int slot) const {
    const std::size_t n = stride();
    const std::int32_t* at = coordinates() + slot;
    return {{at[0], at[n], at[2 * n]}, {at[3 * n], at[4 * n], at[5 * n]}};
  }
  /// Whether a branch is an occupied cuboid, or has one below.
  [[nodiscard]] bool hasOccupied(int slot) const { return (occupied_ >> slot & 1) != 0; }
  /// A branch as a cuboid. @pre The node is a leaf node.
  [[nodiscard]] Cuboid cuboid(int slot) const {
    return {box(slot), hasOccupied(slot) ? Occupancy::kOccupied : Occupancy::kFree};
  }
  /// All data of a branch.
  [[nodiscard]] Branch branch(int slot) const {
    return {box(slot), hasOccupied(slot), child()[slot]};
  }
  /// MBR of all branches, and whether a cuboid in them is occupied. @pre count() > 0.
  [[nodiscard]] Branch summary() const;
  /// Slot of the branch to a child. @pre It is there.
  [[nodiscard]] int slotOf(NodeIndex child_index) const;

  /// Overwrites a branch.
  void set(int slot, const Branch& branch);
  /// Appends a branch. @pre !isFull().
  void append(const Branch& branch) { set(count_++, branch); }
  /// Removes a branch; the last one takes its slot.
  void remove(int slot);
  /// Forgets all branches.
  void clear() { count_ = 0; }

  NodeIndex parent = kNoNode;  ///< The inner node above; undefined in the root.

 private:
  [[nodiscard]] std::size_t stride() const {
    return static_cast<std::size_t>(paddedSlots(capacity_));
  }
  [[nodiscard]] const std::int32_t* coordinates() const {
    return reinterpret_cast<const std::int32_t*>(this + 1);
  }

  std::uint8_t count_ = 0;
  std::uint8_t capacity_;
  SlotSet occupied_ = 0;  ///< See hasOccupied().
};

inline SlotSet Node::findOverlapping(const CellBox& window) const {
  const std::int32_t* min_x = min(0);
  const std::int32_t* min_y = min(1);
  const std::int32_t* min_z = min(2);
  const std::int32_t* max_x = max(0);
  const std::int32_t* max_y = max(1);
  const std::int32_t* max_z = max(2);
  const CellBox w = window;
  return findSlots(count_, [=](int i) {
    return static_cast<int>(min_x[i] < w.max.x) & static_cast<int>(w.min.x < max_x[i]) &
           static_cast<int>(min_y[i] < w.max.y) & static_cast<int>(w.min.y < max_y[i]) &
           static_cast<int>(min_z[i] < w.max.z) & static_cast<int>(w.min.z < max_z[i]);
  });
}

/// Nodes of one capacity.
class NodePool {
 public:
  /// @param capacity  Maximum number of branches of a node (M), up to kMaxSlots.
  explicit NodePool(int capacity) : capacity_(capacity), nodes_(Node::numBytes(capacity)) {}

  /// Reserves memory: the next `num_nodes` calls of allocate() throw nothing. @throws std::bad_alloc
  void reserve(std::size_t num_nodes) { nodes_.reserve(num_nodes); }
  /// Frees memory that no node needs.
  void trim() noexcept { nodes_.trim(); }
  /// Allocates a node without branches. @throws std::bad_alloc  beyond the reserved memory.
  [[nodiscard]] NodeIndex allocate();
  /// Releases a node. @pre It is from allocate(), and has not been released since.
  void release(NodeIndex index) noexcept { nodes_.release(index); }

  /// The node, which does not move until it is released. @pre It is in use.
  ///@{
  [[nodiscard]] Node& operator[](NodeIndex index) {
    return *reinterpret_cast<Node*>(nodes_[index]);
  }
  [[nodiscard]] const Node& operator[](NodeIndex index) const {
    return *reinterpret_cast<const Node*>(nodes_[index]);
  }
  ///@}
  /// Prefetches a node.
  [[gnu::always_inline]] void prefetch(NodeIndex index) const { nodes_.prefetch(index); }

  /// One beyond the greatest number that a node has, or can have without more memory.
  [[nodiscard]] std::size_t endIndex() const { return nodes_.endIndex(); }
  /// Number of nodes in use.
  [[nodiscard]] std::size_t size() const { return nodes_.numItems(); }
  /// Bytes held from the allocator.
  [[nodiscard]] std::size_t numBytes() const { return nodes_.numBytes(); }

 private:
  int capacity_;
  BlockPool nodes_;
};

}  // namespace cuboid_mapping
