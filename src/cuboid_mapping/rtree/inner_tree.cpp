// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/rtree/inner_tree.h"

#include "cuboid_mapping/rtree/quadratic_split.h"

#include <algorithm>
#include <cassert>

namespace cuboid_mapping {
namespace {

/// Slot of the branch with the least expansion to include a box; ties go to the smaller volume.
int findLeastExpansion(const Node& node, const CellBox& box) {
  double volumes[kMaxSlots];
  double expansions[kMaxSlots];
  for (int i = 0; i < node.count(); ++i) {
    double volume = 1.0;
    double expanded = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
      const double lower = node.min(axis)[i];
      const double upper = node.max(axis)[i];
      volume *= upper - lower;
      expanded *= std::max<double>(upper, box.max[axis]) - std::min<double>(lower, box.min[axis]);
    }
    volumes[i] = volume;
    expansions[i] = expanded - volume;
  }
  int best = 0;
  for (int i = 1; i < node.count(); ++i) {
    if (expansions[i] < expansions[best] ||
        (expansions[i] == expansions[best] && volumes[i] < volumes[best])) {
      best = i;
    }
  }
  return best;
}

}  // namespace

InnerTree::InnerTree(const RTreeConfig& config) : config_(config), nodes_(config.max_branches) {
  assert(2 <= config.max_branches && config.max_branches <= RTreeConfig::kMaxBranchesLimit);
  assert(1 <= config.min_branches && 2 * config.min_branches <= config.max_branches);
}

/// A node splits when it is full: each once, and again only after d more branches; with d = 1 it may still be full
/// after a split. A removal inserts up to d - 1 branches of each level again.
void InnerTree::reserve(std::size_t num_insertions, std::size_t num_removals,
                        std::size_t end_leaf) {
  const auto fewest = static_cast<std::size_t>(config_.min_branches);
  std::size_t num_new = 2;
  std::size_t num_splits = num_insertions;
  std::size_t num_removed = num_removals;
  for (std::size_t level = 1; level < kMaxLevels; ++level) {
    if (level >= static_cast<std::size_t>(height_) && num_splits <= 1) break;
    const std::size_t num_here = num_nodes_[level];
    const std::size_t num_added = num_splits + num_removed * (fewest - 1);
    num_splits = num_here > 0 ? std::min(num_added, num_here + num_added / fewest + 1)
                              : (num_added + 1) / fewest;
    num_removed = std::min(num_removed, num_here);
    num_new += num_splits;
  }
  if (end_leaf > leaf_parents_.size()) {
    if (end_leaf > leaf_parents_.capacity()) leaf_parents_.reserve(end_leaf + end_leaf / 8);
    leaf_parents_.resize(end_leaf, kNoNode);
  }
  nodes_.reserve(num_new);
}

std::optional<CellBox> InnerTree::bounds() const {
  if (isEmpty()) return std::nullopt;
  return height_ == 1 ? only_leaf_.box : nodes_[root_].summary().box;
}

Branch InnerTree::summaryOf(NodeIndex index) const {
  Branch branch = nodes_[index].summary();
  branch.child = index;
  return branch;
}

NodeIndex InnerTree::chooseNode(const CellBox& box, int level) const {
  NodeIndex index = root_;
  for (int at = height_ - 1; at > level; --at) {
    index = nodes_[index].child()[findLeastExpansion(nodes_[index], box)];
  }
  return index;
}

NodeIndex InnerTree::chooseLeaf(const CellBox& box) const {
  if (height_ == 1) return only_leaf_.child;
  const Node& node = nodes_[chooseNode(box, 1)];
  return node.child()[findLeastExpansion(node, box)];
}

void InnerTree::insert(const Branch& leaf) noexcept {
  if (height_ == 0) {
    only_leaf_ = leaf;
    height_ = 1;
  } else if (height_ == 1) {
    growRoot(only_leaf_, leaf);
  } else {
    addBranch(chooseNode(leaf.box, 1), 1, leaf);
  }
}

void InnerTree::insertBeside(NodeIndex leaf, const Branch& sibling) noexcept {
  if (height_ == 1) {
    growRoot(only_leaf_, sibling);
  } else {
    addBranch(leaf_parents_[leaf], 1, sibling);
  }
}

void InnerTree::update(const Branch& leaf) noexcept {
  if (height_ == 1) {
    only_leaf_ = leaf;
    return;
  }
  const NodeIndex index = leaf_parents_[leaf.child];
  Node& node = nodes_[index];
  const int slot = node.slotOf(leaf.child);
  if (node.box(slot) == leaf.box && node.hasOccupied(slot) == leaf.has_occupied) return;
  node.set(slot, leaf);
  updateAncestors(index);
}

void InnerTree::remove(NodeIndex leaf) noexcept {
  if (height_ == 1) {
    height_ = 0;
    only_leaf_ = Branch();
    return;
  }
  const NodeIndex index = leaf_parents_[leaf];
  leaf_parents_[leaf] = kNoNode;
  removeBranch(index, 1, nodes_[index].slotOf(leaf));
  shrinkRoot();
}

/// Appends a branch to a node, and sets the child's parent.
void InnerTree::append(NodeIndex index, int level, const Branch& branch) {
  nodes_[index].append(branch);
  (level == 1 ? leaf_parents_[branch.child] : nodes_[branch.child].parent) = index;
}

void InnerTree::fill(NodeIndex index, int level, const Branch* begin, const Branch* end) {
  nodes_[index].clear();
  for (const Branch* branch = begin; branch != end; ++branch) append(index, level, *branch);
}

NodeIndex InnerTree::makeNode(int level) {
  ++num_nodes_[static_cast<std::size_t>(level)];
  return nodes_.allocate();
}

void InnerTree::releaseNode(NodeIndex index, int level) {
  --num_nodes_[static_cast<std::size_t>(level)];
  nodes_.release(index);
}

void InnerTree::addBranch(NodeIndex index, int level, const Branch& branch) {
  if (nodes_[index].isFull()) return split(index, level, branch);
  append(index, level, branch);
  updateAncestors(index);
}

void InnerTree::split(NodeIndex index, int level, const Branch& extra) {
  BranchList branches;
  const Node& full = nodes_[index];
  for (int slot = 0; slot < config_.max_branches; ++slot) branches.push(full.branch(slot));
  branches.push(extra);
  const SplitGroups groups = splitQuadratic(branches, config_.min_branches);
  const NodeIndex sibling = makeNode(level);
  fill(index, level, groups.first.begin(), groups.first.end());
  fill(sibling, level, groups.second.begin(), groups.second.end());
  if (index == root_) {
    growRoot(summaryOf(index), summaryOf(sibling));
    return;
  }
  const NodeIndex parent = nodes_[index].parent;
  nodes_[parent].set(nodes_[parent].slotOf(index), summaryOf(index));
  addBranch(parent, level + 1, summaryOf(sibling));
}

void InnerTree::growRoot(const Branch& first, const Branch& second) {
  const int level = height_++;
  root_ = makeNode(level);
  append(root_, level, first);
  append(root_, level, second);
}

/// Updates the MBRs above a node.
void InnerTree::updateAncestors(NodeIndex index) {
  while (index != root_) {
    const Branch branch = summaryOf(index);
    index = nodes_[index].parent;
    Node& parent = nodes_[index];
    const int slot = parent.slotOf(branch.child);
    if (parent.box(slot) == branch.box && parent.hasOccupied(slot) == branch.has_occupied) return;
    parent.set(slot, branch);
  }
}

/// Removes a branch; a node with too few branches is removed, too, and its branches are inserted
/// again (Guttman's CondenseTree).
void InnerTree::removeBranch(NodeIndex index, int level, int slot) {
  Node& node = nodes_[index];
  node.remove(slot);
  if (index == root_) return;
  if (node.count() >= config_.min_branches) return updateAncestors(index);
  BranchList orphans;
  for (int i = 0; i < node.count(); ++i) orphans.push(node.branch(i));
  const NodeIndex parent = node.parent;
  const int slot_in_parent = nodes_[parent].slotOf(index);
  releaseNode(index, level);
  removeBranch(parent, level + 1, slot_in_parent);
  for (const Branch& orphan : orphans) addBranch(chooseNode(orphan.box, level), level, orphan);
}

void InnerTree::shrinkRoot() {
  while (height_ > 1 && nodes_[root_].count() == 1) {
    const Branch child = nodes_[root_].branch(0);
    releaseNode(root_, --height_);
    if (height_ == 1) {
      leaf_parents_[child.child] = kNoNode;
      only_leaf_ = child;
    } else {
      root_ = child.child;
    }
  }
}

}  // namespace cuboid_mapping
