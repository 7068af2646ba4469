// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/rtree/node.h"

#include <algorithm>
#include <cassert>
#include <new>

namespace cuboid_mapping {

std::size_t Node::numBytes(int capacity) {
  constexpr std::size_t kBranch = sizeof(std::int32_t[6]) + sizeof(NodeIndex);
  return sizeof(Node) + static_cast<std::size_t>(paddedSlots(capacity)) * kBranch;
}

Branch Node::summary() const {
  assert(count_ > 0);
  Branch result;
  for (int axis = 0; axis < 3; ++axis) {
    result.box.min[axis] = *std::min_element(min(axis), min(axis) + count_);
    result.box.max[axis] = *std::max_element(max(axis), max(axis) + count_);
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

void Node::set(int slot, const Branch& branch) {
  const std::size_t n = stride();
  auto* at = const_cast<std::int32_t*>(coordinates()) + slot;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    at[axis * n] = branch.box.min[static_cast<int>(axis)];
    at[(axis + 3) * n] = branch.box.max[static_cast<int>(axis)];
  }
  const_cast<NodeIndex*>(child())[slot] = branch.child;
  const SlotSet bit = SlotSet{1} << slot;
  occupied_ = branch.has_occupied ? occupied_ | bit : occupied_ & ~bit;
}

void Node::remove(int slot) {
  assert(slot < count_);
  --count_;
  if (slot != count_) set(slot, branch(count_));
}

NodeIndex NodePool::allocate() {
  const NodeIndex index = BlockPool::allocate();
  new (BlockPool::operator[](index)) Node(capacity_);
  return index;
}

}  // namespace cuboid_mapping
