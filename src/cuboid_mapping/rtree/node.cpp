// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/rtree/node.h"

#include <algorithm>
#include <cassert>
#include <new>
#include <numeric>

namespace cuboid_mapping {

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

void NodePool::reserve(std::size_t num_nodes) {
  if (num_nodes > unused_.size()) {
    const std::size_t num_more = num_nodes - unused_.size();
    const std::size_t size = nodes_.size() + num_more;
    if (size > unused_.capacity()) unused_.reserve(std::max(size, nodes_.size() * 3 / 2));
    nodes_.resize(size);
    // Nothing throws until the new indices are noted; release() needs no memory.
    const auto first = static_cast<NodeIndex>(size - num_more);
    unused_.insert(unused_.begin(), num_more, first);
    std::iota(unused_.begin(), unused_.begin() + static_cast<std::ptrdiff_t>(num_more), first);
  }
  for (; num_ready_ < num_nodes; ++num_ready_) {
    const NodeIndex next = unused_[unused_.size() - 1 - num_ready_];
    nodes_[next].reset(new std::byte[Node::numBytes(capacity_)]);
  }
}

void NodePool::trim() noexcept {
  for (; num_ready_ > 0; --num_ready_) nodes_[unused_[unused_.size() - num_ready_]].reset();
}

NodeIndex NodePool::allocate() {
  if (num_ready_ == 0) reserve(1);
  const NodeIndex index = unused_.back();
  unused_.pop_back();
  --num_ready_;
  new (nodes_[index].get()) Node(capacity_);
  return index;
}

void NodePool::release(NodeIndex index) noexcept {
  unused_.push_back(index);
  ++num_ready_;
}

std::size_t NodePool::numBytes() const {
  return (numItems() + num_ready_) * Node::numBytes(capacity_) +
         nodes_.capacity() * sizeof(nodes_[0]) + unused_.capacity() * sizeof(NodeIndex);
}

}  // namespace cuboid_mapping
