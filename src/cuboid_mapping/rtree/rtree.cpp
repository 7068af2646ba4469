// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/rtree/rtree.h"

#include "cuboid_mapping/rtree/quadratic_split.h"
#include "cuboid_mapping/rtree/traversal.h"

#include <algorithm>
#include <cassert>

namespace cuboid_mapping {
namespace {

/// Slot of the branch that expands least to take in a box; ties go to the smaller volume.
int findLeastExpansion(const Node& node, const CellBox& box) {
  double volumes[RTreeConfig::kMaxBranchesLimit];
  double expansions[RTreeConfig::kMaxBranchesLimit];
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

Branch toBranch(const Cuboid& cuboid) { return {cuboid.box, cuboid.isOccupied(), kNoNode}; }

}  // namespace

RTree::RTree(const RTreeConfig& config)
    : config_(config),
      leaves_(config.max_branches, true),
      inner_nodes_(config.max_branches, false),
      root_(leaves_.allocate()) {
  assert(2 <= config.max_branches && config.max_branches <= RTreeConfig::kMaxBranchesLimit);
  assert(1 <= config.min_branches && 2 * config.min_branches <= config.max_branches);
}

void RTree::clear() noexcept {
  leaves_.clear();
  inner_nodes_.clear();
  root_ = leaves_.allocate();
  height_ = 1;
  size_ = 0;
}

std::optional<CellBox> RTree::bounds() const {
  if (isEmpty()) return std::nullopt;
  return node(height_ - 1, root_).summary().box;
}

void RTree::select(const CellBox& window, Selection& selection) const {
  visitLeafSlots(*this, window, CuboidFilter::kAll, [&](NodeIndex leaf, int slot) {
    selection.cuboids.push_back(leaves_[leaf].cuboid(slot));
    selection.slots.push_back({leaf, slot});
    return Visit::kContinue;
  });
}

void RTree::insert(const Cuboid& cuboid) {
  assert(!cuboid.box.isEmpty());
  insertBranch(toBranch(cuboid), 0);
  ++size_;
}

bool RTree::remove(const CellBox& box) {
  Selection found;
  select(box, found);
  for (std::size_t i = 0; i < found.cuboids.size(); ++i) {
    if (found.cuboids[i].box == box) {
      TreeChange change;
      change.removed.push_back(found.slots[i]);
      change.endPart();
      replace(change);
      return true;
    }
  }
  return false;
}

NodeIndex RTree::chooseNode(const CellBox& box, int target_level) const {
  NodeIndex index = root_;
  for (int level = height_ - 1; level > target_level; --level) {
    const Node& inner = inner_nodes_[index];
    index = inner.child()[findLeastExpansion(inner, box)];
  }
  return index;
}

void RTree::insertBranch(const Branch& branch, int level) {
  addBranch(chooseNode(branch.box, level), level, branch);
}

void RTree::addBranch(NodeIndex index, int level, const Branch& branch) {
  if (node(level, index).isFull()) {
    splitNode(index, level, branch);
    return;
  }
  append(index, level, branch);
  growAncestors(index, level, branch);
}

void RTree::append(NodeIndex index, int level, const Branch& branch) {
  poolOf(level).append(index, branch);
  if (level > 0) poolOf(level - 1)[branch.child].parent = index;
}

void RTree::fillNode(NodeIndex index, int level, const std::vector<Branch>& branches) {
  poolOf(level)[index].clear();
  for (const Branch& branch : branches) append(index, level, branch);
}

void RTree::splitNode(NodeIndex index, int level, const Branch& extra) {
  std::vector<Branch> branches;
  branches.reserve(static_cast<std::size_t>(config_.max_branches) + 1);
  const Node& full = node(level, index);
  for (int slot = 0; slot < full.count(); ++slot) branches.push_back(full.branch(slot));
  branches.push_back(extra);
  const SplitGroups groups = splitQuadratic(branches, config_.min_branches);

  const NodeIndex sibling = poolOf(level).allocate();
  fillNode(index, level, groups.first);
  fillNode(sibling, level, groups.second);
  Branch first = node(level, index).summary();
  Branch second = node(level, sibling).summary();
  first.child = index;
  second.child = sibling;
  if (index == root_ && level == height_ - 1) {
    growRoot(first, second);
    return;
  }
  Node& parent = inner_nodes_[node(level, index).parent];
  parent.set(parent.slotOf(index), first);
  addBranch(node(level, index).parent, level + 1, second);
  growAncestors(node(level, index).parent, level + 1, first);
}

void RTree::growRoot(const Branch& first, const Branch& second) {
  const NodeIndex new_root = inner_nodes_.allocate();
  fillNode(new_root, height_, {first, second});
  root_ = new_root;
  ++height_;
}

void RTree::growAncestors(NodeIndex index, int level, const Branch& grown) {
  while (level < height_ - 1) {
    const NodeIndex parent_index = node(level, index).parent;
    Node& parent = inner_nodes_[parent_index];
    const int slot = parent.slotOf(index);
    Branch branch = parent.branch(slot);
    if (branch.box.contains(grown.box) && branch.has_occupied >= grown.has_occupied) return;
    branch.box = unite(branch.box, grown.box);
    branch.has_occupied |= grown.has_occupied;
    parent.set(slot, branch);
    index = parent_index;
    ++level;
  }
}

void RTree::condense(std::vector<NodeIndex> touched, Orphans& orphans) {
  for (int level = 0; level < height_ && !touched.empty(); ++level) {
    std::sort(touched.begin(), touched.end());
    touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
    std::vector<NodeIndex> parents;
    if (level < height_ - 1) {
      for (const NodeIndex index : touched) updateOrDetach(index, level, parents, orphans);
    }
    touched = std::move(parents);
  }
  shrinkRoot();
}

void RTree::updateOrDetach(NodeIndex index, int level, std::vector<NodeIndex>& parents,
                           Orphans& orphans) {
  const Node& changed = node(level, index);
  Node& parent = inner_nodes_[changed.parent];
  const int slot = parent.slotOf(index);
  if (changed.count() >= config_.min_branches) {
    Branch branch = changed.summary();
    branch.child = index;
    const Branch old = parent.branch(slot);
    if (old.box == branch.box && old.has_occupied == branch.has_occupied) return;
    parent.set(slot, branch);
    parents.push_back(changed.parent);
    return;
  }
  parents.push_back(changed.parent);
  parent.remove(slot);
  for (int i = 0; i < changed.count(); ++i) {
    if (level == 0) {
      orphans.cuboids.push_back(changed.branch(i));
    } else {
      orphans.subtrees.push_back({changed.child()[i], level - 1});
    }
  }
  poolOf(level).release(index);
}

void RTree::shrinkRoot() {
  while (height_ > 1 && inner_nodes_[root_].count() == 1) {
    const NodeIndex old_root = root_;
    root_ = inner_nodes_[old_root].child()[0];
    inner_nodes_.release(old_root);
    --height_;
  }
  if (height_ > 1 && inner_nodes_[root_].count() == 0) {
    inner_nodes_.release(root_);
    root_ = leaves_.allocate();
    height_ = 1;
  }
}

void RTree::reinsert(const Orphans& orphans) {
  for (auto subtree = orphans.subtrees.rbegin(); subtree != orphans.subtrees.rend(); ++subtree) {
    const auto [index, level] = *subtree;
    if (level + 1 >= height_) {
      dissolve(index, level);  // The tree has become too low to hang the node into it.
      continue;
    }
    Branch branch = node(level, index).summary();
    branch.child = index;
    insertBranch(branch, level + 1);
  }
  for (const Branch& cuboid : orphans.cuboids) insertBranch(cuboid, 0);
}

void RTree::dissolve(NodeIndex index, int level) {
  if (level == 0) {
    for (int slot = 0; slot < leaves_[index].count(); ++slot) {
      insertBranch(leaves_[index].branch(slot), 0);
    }
    leaves_.release(index);
    return;
  }
  for (int slot = 0; slot < inner_nodes_[index].count(); ++slot) {
    dissolve(inner_nodes_[index].child()[slot], level - 1);
  }
  inner_nodes_.release(index);
}

}  // namespace cuboid_mapping
