// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/occupancy/cuboid.h"
#include "cuboid_mapping/rtree/slot_set.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace cuboid_mapping {

/// Place of a node in the pool of its kind (leaves, or inner nodes).
using NodeIndex = std::uint32_t;
/// No node has this place.
constexpr NodeIndex kNoNode = 0xFFFFFFFFU;

/// One branch of a node, gathered from the node's arrays.
///
/// A leaf branch is a cuboid, occupied or free. An inner branch is a child node: `box` is its
/// minimum bounding box (MBRC of the paper); where no cuboid below it is occupied, a search for
/// occupied ones skips it.
struct Branch {
  CellBox box;                ///< Not empty.
  bool has_occupied = false;  ///< The cuboid is occupied, or one below the child is.
  NodeIndex child = kNoNode;  ///< Inner branches only.
};

/// How a node keeps the boxes of its branches.
enum class NodeKind : std::uint8_t {
  kInner,     ///< int32 coordinates.
  kLeaf,      ///< Offsets of 0 to 255 voxels from an origin that the branches share: 6 bytes a box.
  kWideLeaf,  ///< A leaf that is too large for that: int32 coordinates, outside the node.
};

/// Header of a node; its branches follow it in memory in struct-of-arrays order, so that one loop
/// tests all of them with SIMD instructions. Lives in a NodePool only, which chooses the kind.
class Node {
 public:
  /// Most voxels over which a NodeKind::kLeaf can extend along an axis.
  static constexpr std::int64_t kMaxOffset = 255;

  /// Without branches. @pre It lies in numBytes(capacity, is_leaf) bytes, capacity <= kMaxSlots.
  Node(int capacity, bool is_leaf)
      : capacity_(static_cast<std::uint8_t>(capacity)),
        kind_(is_leaf ? NodeKind::kLeaf : NodeKind::kInner) {}
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  /// Bytes of a node with room for `capacity` branches.
  [[nodiscard]] static std::size_t numBytes(int capacity, bool is_leaf);
  /// Bytes of the boxes of a wide leaf.
  [[nodiscard]] static std::size_t numWideBytes(int capacity);

  /// Branches; they are in slots 0 to count() - 1.
  [[nodiscard]] int count() const { return count_; }
  /// Most branches (M of the paper).
  [[nodiscard]] int capacity() const { return capacity_; }
  /// Whether count() is capacity().
  [[nodiscard]] bool isFull() const { return count_ == capacity_; }
  /// How the boxes are kept; of a leaf it may change with any branch.
  [[nodiscard]] NodeKind kind() const { return kind_; }
  /// Whether branches are cuboids.
  [[nodiscard]] bool isLeaf() const { return kind_ != NodeKind::kInner; }
  /// The slots of all branches.
  [[nodiscard]] SlotSet allSlots() const { return firstSlots(count_); }

  /// The child of each branch, by slot. @pre !isLeaf().
  [[nodiscard]] const NodeIndex* child() const {
    return reinterpret_cast<const NodeIndex*>(data() + sizeof(std::int32_t[6]) * stride());
  }
  /// Least cells (min) and ends (max, excluded) of the boxes along an axis, by slot.
  /// @pre kind() is not NodeKind::kLeaf.
  ///@{
  [[nodiscard]] const std::int32_t* min(int axis) const {
    return coordinates() + static_cast<std::size_t>(axis) * stride();
  }
  [[nodiscard]] const std::int32_t* max(int axis) const { return min(axis + 3); }
  ///@}

  /// Box of a branch: a cuboid, or the MBR of a child.
  [[nodiscard]] CellBox box(int slot) const;
  /// Whether a branch is an occupied cuboid, or has one below.
  [[nodiscard]] bool hasOccupied(int slot) const { return (occupied_ >> slot & 1) != 0; }
  /// A branch as a cuboid. @pre isLeaf().
  [[nodiscard]] Cuboid cuboid(int slot) const {
    return {box(slot), hasOccupied(slot) ? Occupancy::kOccupied : Occupancy::kFree};
  }
  /// Everything about a branch, of any kind of node.
  [[nodiscard]] Branch branch(int slot) const {
    return {box(slot), hasOccupied(slot), isLeaf() ? kNoNode : child()[slot]};
  }

  /// Coordinates of one face of all boxes; those up to paddedSlots(count()) are written.
  /// @param face  0, 1, 2: least x, y, z; 3, 4, 5: greatest x, y, z.
  void getFaces(int face, double (&coordinates)[kMaxSlots]) const;

  /// Branches that share a cell with the window. @pre the window is not empty.
  [[nodiscard]] SlotSet findOverlapping(const CellBox& window) const;
  /// Branches that are occupied cuboids, or have some below.
  [[nodiscard]] SlotSet occupiedSlots() const { return occupied_ & allSlots(); }

  /// Bounding box of all branches, and whether one of them has something occupied. @pre count() > 0.
  [[nodiscard]] Branch summary() const;

  /// Slot of the branch to a child. @pre it is there.
  [[nodiscard]] int slotOf(NodeIndex child_index) const;

  /// Whether a box can be set as things are: false for a leaf that must change its origin or kind.
  [[nodiscard]] bool canHold(const CellBox& box) const;
  /// Overwrites a branch. @pre canHold(branch.box).
  void set(int slot, const Branch& branch);
  /// Adds a branch behind the last. @pre !isFull() and canHold(branch.box).
  void append(const Branch& branch) { set(count_++, branch); }
  /// The last branch takes the place of the removed one.
  void remove(int slot);
  /// Forgets all branches; kind and origin stay.
  void clear() { count_ = 0; }

  NodeIndex parent = kNoNode;  ///< The inner node above; says nothing in the root.

 private:
  friend class NodePool;

  /// What a wide leaf has in place of offsets.
  struct WideBoxes {
    std::int32_t* coordinates;
    std::uint32_t index;  ///< In the pool of wide boxes.
  };

  [[nodiscard]] std::size_t stride() const {
    return static_cast<std::size_t>(paddedSlots(capacity_));
  }
  [[nodiscard]] const std::byte* data() const {
    return reinterpret_cast<const std::byte*>(this + 1);
  }
  [[nodiscard]] std::byte* data() { return reinterpret_cast<std::byte*>(this + 1); }
  [[nodiscard]] const std::uint8_t* offsets() const {
    return reinterpret_cast<const std::uint8_t*>(data());
  }
  [[nodiscard]] WideBoxes wideBoxes() const {
    WideBoxes boxes;
    std::memcpy(&boxes, data(), sizeof(boxes));
    return boxes;
  }
  [[nodiscard]] const std::int32_t* coordinates() const {
    return isLeaf() ? wideBoxes().coordinates : reinterpret_cast<const std::int32_t*>(data());
  }

  std::uint8_t count_ = 0;
  std::uint8_t capacity_;
  NodeKind kind_;
  Cell origin_;           ///< Of the offsets of a NodeKind::kLeaf.
  SlotSet occupied_ = 0;  ///< See hasOccupied().
};

inline CellBox Node::box(int slot) const {
  const std::size_t n = stride();
  if (kind_ == NodeKind::kLeaf) {
    const std::uint8_t* offset = offsets() + slot;
    return {origin_ + Cell{offset[0], offset[n], offset[2 * n]},
            origin_ + Cell{offset[3 * n], offset[4 * n], offset[5 * n]}};
  }
  const std::int32_t* at = coordinates() + slot;
  return {{at[0], at[n], at[2 * n]}, {at[3 * n], at[4 * n], at[5 * n]}};
}

namespace node_detail {

/// Branches whose boxes, six arrays of coordinates, share a cell with the one from lower to upper.
template <typename CoordinateT>
SlotSet findOverlapping(const CoordinateT* boxes, std::size_t stride, int count,
                        const CoordinateT (&lower)[3], const CoordinateT (&upper)[3]) {
  const CoordinateT* min_x = boxes;
  const CoordinateT* min_y = boxes + stride;
  const CoordinateT* min_z = boxes + 2 * stride;
  const CoordinateT* max_x = boxes + 3 * stride;
  const CoordinateT* max_y = boxes + 4 * stride;
  const CoordinateT* max_z = boxes + 5 * stride;
  const CoordinateT from[] = {lower[0], lower[1], lower[2]};
  const CoordinateT to[] = {upper[0], upper[1], upper[2]};
  return findSlots(count, [=](int i) {
    return static_cast<int>(min_x[i] < to[0]) & static_cast<int>(from[0] < max_x[i]) &
           static_cast<int>(min_y[i] < to[1]) & static_cast<int>(from[1] < max_y[i]) &
           static_cast<int>(min_z[i] < to[2]) & static_cast<int>(from[2] < max_z[i]);
  });
}

}  // namespace node_detail

inline void Node::getFaces(int face, double (&coordinates)[kMaxSlots]) const {
  const int end = paddedSlots(count_);
  const std::size_t at = static_cast<std::size_t>(face) * stride();
  if (kind_ != NodeKind::kLeaf) {
    const std::int32_t* from = this->coordinates() + at;
    for (int i = 0; i < end; ++i) coordinates[i] = from[i];
    return;
  }
  const std::uint8_t* from = offsets() + at;
  const std::int32_t origin = origin_[face % 3];
  std::int32_t absolute[kMaxSlots];
  for (int i = 0; i < end; ++i) absolute[i] = origin + from[i];
  for (int i = 0; i < end; ++i) coordinates[i] = absolute[i];
}

inline SlotSet Node::findOverlapping(const CellBox& window) const {
  if (kind_ != NodeKind::kLeaf) {
    const std::int32_t lower[] = {window.min.x, window.min.y, window.min.z};
    const std::int32_t upper[] = {window.max.x, window.max.y, window.max.z};
    return node_detail::findOverlapping(coordinates(), stride(), count_, lower, upper);
  }
  // A window cut to the reach of the offsets shares the same cells with the branches.
  std::uint8_t lower[3];
  std::uint8_t upper[3];
  for (int axis = 0; axis < 3; ++axis) {
    const auto cut = [origin = std::int64_t{origin_[axis]}](std::int32_t coordinate) {
      return static_cast<std::uint8_t>(
          std::clamp<std::int64_t>(coordinate - origin, 0, kMaxOffset));
    };
    lower[axis] = cut(window.min[axis]);
    upper[axis] = cut(window.max[axis]);
  }
  return node_detail::findOverlapping(offsets(), stride(), count_, lower, upper);
}

}  // namespace cuboid_mapping
