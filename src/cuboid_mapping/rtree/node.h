// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/occupancy/cuboid.h"
#include "cuboid_mapping/rtree/rtree_config.h"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <vector>

namespace cuboid_mapping {

/// Set of slots of a node: bit i stands for slot i.
using SlotSet = std::uint64_t;

/// Maximum number of slots of a node.
constexpr int kMaxSlots = RTreeConfig::kMaxBranchesLimit;

/// Number of slots for one step of a loop over a node's arrays, whatever the number of branches, so
/// that the compiler turns each step into SIMD instructions; the arrays are padded to multiples.
constexpr int kSlotGroup = 16;

/// Number of slots rounded up to whole groups.
[[nodiscard]] constexpr int paddedSlots(int count) {
  return (count + kSlotGroup - 1) / kSlotGroup * kSlotGroup;
}

/// The first `count` slots. @pre 0 <= count <= kMaxSlots.
[[nodiscard]] constexpr SlotSet firstSlots(int count) {
  return count == 0 ? 0 : ~SlotSet{0} >> (kMaxSlots - count);
}

/// Least slot of a set. @pre the set is not empty.
[[nodiscard]] inline int firstSlot(SlotSet slots) { return __builtin_ctzll(slots); }

/// The set without its least slot: `for (; slots != 0; slots = withoutFirst(slots))`.
[[nodiscard]] constexpr SlotSet withoutFirst(SlotSet slots) { return slots & (slots - 1); }

/// A flag, 0 or 1, for each slot of a group.
using SlotFlags = std::uint8_t[kSlotGroup];

/// The flags of a group as bits 0 to kSlotGroup - 1.
[[nodiscard]] inline SlotSet packFlags(const SlotFlags& flags) {
  static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "flag 0 is the lowest byte of a word");
  std::uint64_t words[2];
  static_assert(sizeof(words) == sizeof(flags));
  std::memcpy(words, flags, sizeof(flags));
  constexpr std::uint64_t kBytesToBits = 0x0102040810204080ULL;  // Byte i to bit 56 + i.
  return words[0] * kBytesToBits >> 56 | words[1] * kBytesToBits >> 56 << 8;
}

/// Slots below `count` that pass a test.
/// @param test  (int slot) -> bool without a branch; called for the slots of whole groups.
template <typename TestT>
[[nodiscard]] SlotSet findSlots(int count, TestT test) {
  SlotSet found = 0;
  for (int first = 0; first < count; first += kSlotGroup) {
    SlotFlags flags;
    for (int i = 0; i < kSlotGroup; ++i) flags[i] = static_cast<std::uint8_t>(test(first + i));
    found |= packFlags(flags) << first;
  }
  return found & firstSlots(count);
}

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
  [[nodiscard]] static constexpr std::size_t numBytes(int capacity);

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

constexpr std::size_t Node::numBytes(int capacity) {
  constexpr std::size_t kBranch = sizeof(std::int32_t[6]) + sizeof(NodeIndex);
  return sizeof(Node) + static_cast<std::size_t>(paddedSlots(capacity)) * kBranch;
}

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

/// Nodes of one capacity by index. Indices of released nodes are used again.
class NodePool {
 public:
  /// @param capacity  Maximum number of branches of a node (M), up to kMaxSlots.
  explicit NodePool(int capacity) : capacity_(capacity) {}

  /// Reserves memory: the next `num_nodes` calls of allocate() throw nothing. @throws std::bad_alloc
  void reserve(std::size_t num_nodes);
  /// Frees the memory of nodes that are not in use. @complexity O(these nodes).
  void trim() noexcept;

  /// Allocates a node without branches. @throws std::bad_alloc  beyond the reserved memory.
  [[nodiscard]] NodeIndex allocate();
  /// Releases a node, and keeps its memory. @pre It is in use.
  void release(NodeIndex index) noexcept;

  /// The node, which does not move until it is released. @pre It is in use.
  ///@{
  [[nodiscard]] Node& operator[](NodeIndex index) {
    return *reinterpret_cast<Node*>(nodes_[index].get());
  }
  [[nodiscard]] const Node& operator[](NodeIndex index) const {
    return *reinterpret_cast<const Node*>(nodes_[index].get());
  }
  ///@}
  /// Prefetches a node. This function and its callers must be inline: gcc drops calls of functions that do nothing
  /// else.
  [[gnu::always_inline]] void prefetch(NodeIndex index) const {
    constexpr std::size_t kCacheLine_bytes = 64;
    const std::byte* node = nodes_[index].get();
    for (std::size_t i = 0; i < Node::numBytes(capacity_); i += kCacheLine_bytes) {
      __builtin_prefetch(node + i);
    }
  }

  /// One beyond the greatest index that a node has, or can have without more memory.
  [[nodiscard]] std::size_t endIndex() const { return nodes_.size(); }
  /// Number of nodes in use.
  [[nodiscard]] std::size_t numItems() const { return nodes_.size() - unused_.size(); }
  /// Bytes held from the allocator.
  [[nodiscard]] std::size_t numBytes() const;

 private:
  int capacity_;
  std::vector<std::unique_ptr<std::byte[]>> nodes_;  ///< By index.
  std::vector<NodeIndex> unused_;                    ///< Those with memory are last.
  std::size_t num_ready_ = 0;                        ///< Number of unused nodes with memory.
};

}  // namespace cuboid_mapping
