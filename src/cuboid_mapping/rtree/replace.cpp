// SPDX-License-Identifier: BSD-3-Clause
// RTree::replace, in its steps: plan, apply to the leaves, build new leaves, condense, insert.
#include "cuboid_mapping/geometry/brick.h"
#include "cuboid_mapping/rtree/pack.h"
#include "cuboid_mapping/rtree/rtree.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace cuboid_mapping {
namespace {

/// How many branches a newly built leaf gets, as a share of M: room for the bricks to change.
constexpr double kNewLeafFill = 0.95;

/// A leaf that gets too full shares with a sibling if both are at most this full afterwards.
constexpr double kMostSharedFill = 0.95;

/// Two leaves share only if the box around them is larger than they are by at most this ratio:
/// leaves that lie apart would overlap others afterwards.
constexpr double kMostWaste = 0.5;

Branch branchOf(const Cuboid& cuboid) { return {cuboid.box, cuboid.isOccupied(), kNoNode}; }

void appendBranches(const Node& node, std::vector<Branch>& branches) {
  for (int slot = 0; slot < node.count(); ++slot) branches.push_back(node.branch(slot));
}

/// A cuboid that wants a free place in a leaf.
struct Refill {
  NodeIndex leaf;
  Branch branch;
};

}  // namespace

/// Who takes whose place.
struct RTree::ReplacePlan {
  struct Overwrite {
    LeafSlot slot;
    Branch branch;
  };
  std::vector<Overwrite> overwrites;
  std::vector<LeafSlot> vacated;
  std::vector<Refill> refills;  ///< In a leaf in which the part had cuboids before.
  std::vector<Branch> fresh;    ///< Of parts that lost nothing.
};

void RTree::replace(const TreeChange& change) {
  ReplacePlan plan = planReplace(change);
  std::vector<NodeIndex> touched;
  Orphans orphans;
  for (const auto& [slot, branch] : plan.overwrites) {
    leaves_.set(slot.leaf, slot.slot, branch);
    touched.push_back(slot.leaf);
  }
  // From the last slot of a leaf to the first, because a removal moves the last branch.
  std::sort(plan.vacated.begin(), plan.vacated.end(), [](const LeafSlot& a, const LeafSlot& b) {
    return a.leaf != b.leaf ? a.leaf < b.leaf : a.slot > b.slot;
  });
  for (const LeafSlot& slot : plan.vacated) {
    leaves_.remove(slot.leaf, slot.slot);
    touched.push_back(slot.leaf);
  }
  refill(plan, touched, orphans);
  fillNewLeaves(plan.fresh, orphans);
  condense(std::move(touched), orphans);
  reinsert(orphans);
  size_ += change.added.size();
  size_ -= change.removed.size();
}

RTree::ReplacePlan RTree::planReplace(const TreeChange& change) {
  ReplacePlan plan;
  std::size_t out = 0;
  std::size_t in = 0;
  for (const TreeChange::Part& part : change.parts) {
    NodeIndex last_leaf = kNoNode;
    for (; out < part.removed_end; ++out) {
      const LeafSlot& slot = change.removed[out];
      last_leaf = slot.leaf;
      if (in < part.added_end) {
        plan.overwrites.push_back({slot, branchOf(change.added[in++])});
      } else {
        plan.vacated.push_back(slot);
      }
    }
    for (; in < part.added_end; ++in) {
      if (last_leaf == kNoNode) {
        plan.fresh.push_back(branchOf(change.added[in]));
      } else {
        plan.refills.push_back({last_leaf, branchOf(change.added[in])});
      }
    }
  }
  return plan;
}

void RTree::refill(ReplacePlan& plan, std::vector<NodeIndex>& touched, Orphans& orphans) {
  std::stable_sort(plan.refills.begin(), plan.refills.end(),
                   [](const Refill& a, const Refill& b) { return a.leaf < b.leaf; });
  for (auto first = plan.refills.begin(); first != plan.refills.end();) {
    const NodeIndex leaf = first->leaf;
    const auto last = std::find_if(first, plan.refills.end(),
                                   [leaf](const Refill& refill) { return refill.leaf != leaf; });
    touched.push_back(leaf);
    const int num_wanted = leaves_[leaf].count() + static_cast<int>(last - first);
    if (num_wanted <= config_.max_branches) {
      for (; first != last; ++first) leaves_.append(leaf, first->branch);
      continue;
    }
    std::vector<NodeIndex> reused{leaf};
    if (const NodeIndex sibling = findSharingSibling(leaf, num_wanted); sibling != kNoNode) {
      reused.push_back(sibling);
      touched.push_back(sibling);
    }
    std::vector<Branch> branches;
    for (const NodeIndex index : reused) appendBranches(leaves_[index], branches);
    for (; first != last; ++first) branches.push_back(first->branch);
    packLeaves(std::move(branches), reused, orphans);
  }
}

NodeIndex RTree::findSharingSibling(NodeIndex leaf, int num_wanted) const {
  if (height_ == 1) return kNoNode;
  const Node& parent = inner_nodes_[leaves_[leaf].parent];
  const CellBox box = parent.box(parent.slotOf(leaf));
  const int most = static_cast<int>(kMostSharedFill * 2 * config_.max_branches);
  NodeIndex best = kNoNode;
  double least_waste = kMostWaste;
  for (int slot = 0; slot < parent.count(); ++slot) {
    const NodeIndex sibling = parent.child()[slot];
    const CellBox other = parent.box(slot);
    const double volume = box.numVoxels() + other.numVoxels();
    const double waste = (unite(box, other).numVoxels() - volume) / volume;
    if (waste > least_waste || sibling == leaf) continue;
    if (leaves_[sibling].count() + num_wanted > most) continue;
    least_waste = waste;
    best = sibling;
  }
  return best;
}

/// New leaves of neighbours in the given order.
void RTree::fillNewLeaves(const std::vector<Branch>& branches, Orphans& orphans) {
  const std::size_t num_leaves = numLeavesFor(branches.size());
  std::vector<std::size_t> ends;
  for (std::size_t i = 1; i <= num_leaves; ++i) ends.push_back(branches.size() * i / num_leaves);
  fillLeaves(branches, ends, {}, orphans);
}

/// Leaves of neighbours that share least.
/// @param reused  Leaves whose branches these were: at least so many leaves are filled again.
void RTree::packLeaves(std::vector<Branch> branches, const std::vector<NodeIndex>& reused,
                       Orphans& orphans) {
  const auto fewest = static_cast<std::size_t>(config_.min_branches);
  const auto most = static_cast<std::size_t>(config_.max_branches);
  const std::size_t num_leaves =
      branches.size() > reused.size() * most ? numLeavesFor(branches.size()) : reused.size();
  const auto ends = packBranches(branches, {num_leaves, fewest, most});
  fillLeaves(branches, ends, reused, orphans);
}

/// How many new leaves so many branches need; 0 when they are too few for one.
std::size_t RTree::numLeavesFor(std::size_t num_branches) const {
  const auto wanted = static_cast<std::size_t>(
      std::ceil(static_cast<double>(num_branches) / (kNewLeafFill * config_.max_branches)));
  return std::min(wanted, num_branches / static_cast<std::size_t>(config_.min_branches));
}

/// @param ends  Of the branches of each leaf; with none the branches are left for themselves.
void RTree::fillLeaves(const std::vector<Branch>& branches, const std::vector<std::size_t>& ends,
                       const std::vector<NodeIndex>& reused, Orphans& orphans) {
  if (ends.empty()) {
    orphans.cuboids.insert(orphans.cuboids.end(), branches.begin(), branches.end());
  }
  std::size_t next = 0;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const bool is_new = i >= reused.size();
    const NodeIndex leaf = is_new ? leaves_.allocate() : reused[i];
    leaves_[leaf].clear();
    for (; next < ends[i]; ++next) leaves_.append(leaf, branches[next]);
    if (is_new) orphans.subtrees.push_back({leaf, 0});
  }
}

}  // namespace cuboid_mapping
