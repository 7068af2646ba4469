// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/rtree/node.h"

#include <algorithm>
#include <cassert>

namespace cuboid_mapping {
namespace {

/// Least of the first three arrays and greatest of the last three, as a box.
template <typename CoordinateT>
CellBox boundsOf(const CoordinateT* boxes, std::size_t stride, int count) {
  CellBox bounds;
  for (int axis = 0; axis < 3; ++axis) {
    const CoordinateT* min = boxes + static_cast<std::size_t>(axis) * stride;
    const CoordinateT* max = min + 3 * stride;
    bounds.min[axis] = *std::min_element(min, min + count);
    bounds.max[axis] = *std::max_element(max, max + count);
  }
  return bounds;
}

}  // namespace

std::size_t Node::numBytes(int capacity, bool is_leaf) {
  constexpr std::size_t kLeafBranch = sizeof(std::uint8_t[6]);
  constexpr std::size_t kInnerBranch = sizeof(std::int32_t[6]) + sizeof(NodeIndex);
  static_assert(sizeof(WideBoxes) <= sizeof(std::uint8_t[6]) * kSlotGroup);
  return sizeof(Node) +
         static_cast<std::size_t>(paddedSlots(capacity)) * (is_leaf ? kLeafBranch : kInnerBranch);
}

std::size_t Node::numWideBytes(int capacity) {
  return static_cast<std::size_t>(paddedSlots(capacity)) * sizeof(std::int32_t[6]);
}

Branch Node::summary() const {
  assert(count_ > 0);
  Branch result;
  if (kind_ == NodeKind::kLeaf) {
    const CellBox bounds = boundsOf(offsets(), stride(), count_);
    result.box = {origin_ + bounds.min, origin_ + bounds.max};
  } else {
    result.box = boundsOf(coordinates(), stride(), count_);
  }
  result.has_occupied = occupiedSlots() != 0;
  return result;
}

int Node::slotOf(NodeIndex child_index) const {
  const NodeIndex* begin = child();
  const NodeIndex* found = std::find(begin, begin + count_, child_index);
  assert(found != begin + count_);
  return static_cast<int>(found - begin);
}

bool Node::canHold(const CellBox& box) const {
  if (kind_ != NodeKind::kLeaf) return true;
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t origin = origin_[axis];
    if (box.min[axis] < origin || box.max[axis] - origin > kMaxOffset) return false;
  }
  return true;
}

void Node::set(int slot, const Branch& branch) {
  assert(canHold(branch.box));
  const std::size_t n = stride();
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t at = static_cast<std::size_t>(axis) * n + static_cast<std::size_t>(slot);
    if (kind_ == NodeKind::kLeaf) {
      auto* out = reinterpret_cast<std::uint8_t*>(data()) + at;
      out[0] = static_cast<std::uint8_t>(branch.box.min[axis] - origin_[axis]);
      out[3 * n] = static_cast<std::uint8_t>(branch.box.max[axis] - origin_[axis]);
    } else {
      auto* out = const_cast<std::int32_t*>(coordinates()) + at;
      out[0] = branch.box.min[axis];
      out[3 * n] = branch.box.max[axis];
    }
  }
  const SlotSet bit = SlotSet{1} << slot;
  occupied_ = branch.has_occupied ? occupied_ | bit : occupied_ & ~bit;
  if (!isLeaf()) const_cast<NodeIndex*>(child())[slot] = branch.child;
}

void Node::remove(int slot) {
  assert(slot < count_);
  --count_;
  if (slot != count_) set(slot, branch(count_));
}

}  // namespace cuboid_mapping
