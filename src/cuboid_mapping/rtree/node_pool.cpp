// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/rtree/node_pool.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <new>

namespace cuboid_mapping {
namespace {

/// Origin of a leaf with one box, with room for others on all sides; a brick and its neighbours
/// seldom lie across multiples of it.
Cell originFor(const Cell& least) {
  constexpr std::int32_t kRaster = 128;
  return {least.x & ~(kRaster - 1), least.y & ~(kRaster - 1), least.z & ~(kRaster - 1)};
}

bool fitsOffsets(const CellBox& bounds) {
  for (int axis = 0; axis < 3; ++axis) {
    if (std::int64_t{bounds.max[axis]} - bounds.min[axis] > Node::kMaxOffset) return false;
  }
  return true;
}

}  // namespace

NodePool::NodePool(int capacity, bool is_leaf)
    : capacity_(capacity),
      is_leaf_(is_leaf),
      nodes_(Node::numBytes(capacity, is_leaf), true),
      wide_boxes_(Node::numWideBytes(capacity)) {}

NodeIndex NodePool::allocate() {
  const NodeIndex index = nodes_.allocate();
  new (nodes_[index]) Node(capacity_, is_leaf_);
  return index;
}

void NodePool::release(NodeIndex index) {
  if (is_leaf_) setKind((*this)[index], NodeKind::kLeaf);
  nodes_.release(index);
}

void NodePool::clear() noexcept {
  nodes_.clear();
  wide_boxes_.clear();
}

void NodePool::set(NodeIndex index, int slot, const Branch& branch) {
  Node& node = (*this)[index];
  if (node.kind() != NodeKind::kWideLeaf && node.canHold(branch.box)) {
    node.set(slot, branch);
    return;
  }
  Branch branches[kMaxSlots];
  for (int i = 0; i < node.count(); ++i) branches[i] = node.branch(i);
  branches[slot] = branch;
  rewrite(node, branches, node.count());
}

void NodePool::append(NodeIndex index, const Branch& branch) {
  Node& node = (*this)[index];
  assert(!node.isFull());
  if (node.kind() == NodeKind::kLeaf && node.count() == 0) node.origin_ = originFor(branch.box.min);
  ++node.count_;
  set(index, node.count() - 1, branch);
}

void NodePool::remove(NodeIndex index, int slot) {
  Node& node = (*this)[index];
  node.remove(slot);
  if (node.kind() == NodeKind::kWideLeaf && node.count() > 0) set(index, 0, node.branch(0));
}

void NodePool::setKind(Node& leaf, NodeKind kind) {
  if (leaf.kind_ == kind) return;
  if (kind == NodeKind::kWideLeaf) {
    const std::uint32_t boxes = wide_boxes_.allocate();
    const Node::WideBoxes wide{reinterpret_cast<std::int32_t*>(wide_boxes_[boxes]), boxes};
    std::memcpy(leaf.data(), &wide, sizeof(wide));
  } else {
    wide_boxes_.release(leaf.wideBoxes().index);
  }
  leaf.kind_ = kind;
}

void NodePool::rewrite(Node& leaf, const Branch* branches, int count) {
  CellBox bounds = branches[0].box;
  for (int i = 1; i < count; ++i) bounds = unite(bounds, branches[i].box);
  setKind(leaf, fitsOffsets(bounds) ? NodeKind::kLeaf : NodeKind::kWideLeaf);
  leaf.origin_ = bounds.min;
  for (int i = 0; i < count; ++i) leaf.set(i, branches[i]);
}

}  // namespace cuboid_mapping
