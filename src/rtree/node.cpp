// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/rtree/node.h"

#include <algorithm>
#include <cassert>
#include <new>

namespace cuboid_mapping {

Branch Node::summary() const {
  assert(count_ > 0);
  Branch result;
  for (int axis = 0; axis < 3; ++axis) {
    result.box.min[axis] = *std::min_element(min(axis), min(axis) + count_);
    result.box.max[axis] = *std::max_element(max(axis), max(axis) + count_);
  }
  result.value = *std::max_element(value(), value() + count_);
  return result;
}

int Node::slotOf(NodeIndex child_index) const {
  const NodeIndex* begin = child();
  const NodeIndex* found = std::find(begin, begin + count_, child_index);
  assert(found != begin + count_);
  return static_cast<int>(found - begin);
}

void Node::set(int slot, const Branch& branch) {
  auto* bounds_out = reinterpret_cast<std::int32_t*>(this + 1) + slot;
  for (int axis = 0; axis < 3; ++axis) {
    bounds_out[axis * capacity_] = branch.box.min[axis];
    bounds_out[(3 + axis) * capacity_] = branch.box.max[axis];
  }
  const_cast<float*>(value())[slot] = branch.value;
  if (!is_leaf_) const_cast<NodeIndex*>(child())[slot] = branch.child;
}

void Node::remove(int slot) {
  assert(slot < count_);
  --count_;
  if (slot != count_) set(slot, branch(count_));
}

NodePool::NodePool(int capacity, bool is_leaf)
    : capacity_(capacity), is_leaf_(is_leaf), node_bytes_(Node::numBytes(capacity, is_leaf)) {}

NodeIndex NodePool::allocate() {
  NodeIndex index;
  if (!free_.empty()) {
    index = free_.back();
    free_.pop_back();
  } else {
    index = static_cast<NodeIndex>(num_allocated_++);
    if ((index & (kBlockNodes - 1)) == 0) {
      blocks_.emplace_back(new std::byte[kBlockNodes * node_bytes_]);
    }
  }
  new (address(index)) Node(capacity_, is_leaf_);
  return index;
}

void NodePool::release(NodeIndex index) { free_.push_back(index); }

void NodePool::clear() {
  blocks_.clear();
  free_.clear();
  num_allocated_ = 0;
}

std::size_t NodePool::numBytes() const {
  return blocks_.size() * kBlockNodes * node_bytes_ + blocks_.capacity() * sizeof(blocks_[0]) +
         free_.capacity() * sizeof(NodeIndex);
}

}  // namespace cuboid_mapping
