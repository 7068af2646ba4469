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

Branch toBranch(const Cuboid& cuboid) { return {cuboid.box, cuboid.log_odds, kNoNode}; }

void appendBranches(const Node& node, std::vector<Branch>& branches) {
  for (int slot = 0; slot < node.count(); ++slot) branches.push_back(node.branch(slot));
}

/// A cuboid to remove or to add, with the brick of its least cell.
template <typename ItemT>
struct Keyed {
  Cell brick;
  ItemT item;
};

template <typename ItemT>
void sortByBrick(std::vector<Keyed<ItemT>>& items) {
  std::stable_sort(items.begin(), items.end(), [](const auto& a, const auto& b) {
    return isBeforeOnMortonCurve(a.brick, b.brick);
  });
}

/// A cuboid that wants a free place in a leaf.
struct Refill {
  NodeIndex leaf;
  std::uint32_t added;
};

}  // namespace

/// Who takes whose place.
struct RTree::ReplacePlan {
  struct Overwrite {
    LeafSlot slot;
    std::uint32_t added;
  };
  std::vector<Overwrite> overwrites;
  std::vector<LeafSlot> vacated;
  std::vector<Refill> refills;  ///< In a leaf in which the brick had cuboids before.
  std::vector<Branch> fresh;    ///< Of bricks that lost nothing.
};

void RTree::replace(const std::vector<LeafSlot>& removed, const std::vector<Cuboid>& added) {
  ReplacePlan plan = planReplace(removed, added);
  std::vector<NodeIndex> touched;
  Orphans orphans;
  for (const auto& [slot, i] : plan.overwrites) {
    leaves_.set(slot.leaf, slot.slot, toBranch(added[i]));
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
  refill(plan, added, touched, orphans);
  packLeaves(std::move(plan.fresh), {}, orphans);
  condense(std::move(touched), orphans);
  reinsert(orphans);
  size_ += added.size();
  size_ -= removed.size();
}

RTree::ReplacePlan RTree::planReplace(const std::vector<LeafSlot>& removed,
                                      const std::vector<Cuboid>& added) const {
  std::vector<Keyed<LeafSlot>> outgoing;
  outgoing.reserve(removed.size());
  for (const LeafSlot& slot : removed) {
    outgoing.push_back({brickOf(leaves_[slot.leaf].box(slot.slot).min), slot});
  }
  std::vector<Keyed<std::uint32_t>> incoming;
  incoming.reserve(added.size());
  for (std::uint32_t i = 0; i < added.size(); ++i) {
    incoming.push_back({brickOf(added[i].box.min), i});
  }
  sortByBrick(outgoing);
  sortByBrick(incoming);

  ReplacePlan plan;
  auto out = outgoing.begin();
  auto in = incoming.begin();
  while (out != outgoing.end() || in != incoming.end()) {
    const bool is_out_next =
        in == incoming.end() ||
        (out != outgoing.end() && !isBeforeOnMortonCurve(in->brick, out->brick));
    const Cell brick = is_out_next ? out->brick : in->brick;
    NodeIndex last_leaf = kNoNode;
    for (; out != outgoing.end() && out->brick == brick; ++out) {
      last_leaf = out->item.leaf;
      if (in != incoming.end() && in->brick == brick) {
        plan.overwrites.push_back({out->item, in++->item});
      } else {
        plan.vacated.push_back(out->item);
      }
    }
    for (; in != incoming.end() && in->brick == brick; ++in) {
      if (last_leaf == kNoNode) {
        plan.fresh.push_back(toBranch(added[in->item]));
      } else {
        plan.refills.push_back({last_leaf, in->item});
      }
    }
  }
  return plan;
}

void RTree::refill(ReplacePlan& plan, const std::vector<Cuboid>& added,
                   std::vector<NodeIndex>& touched, Orphans& orphans) {
  std::stable_sort(plan.refills.begin(), plan.refills.end(),
                   [](const Refill& a, const Refill& b) { return a.leaf < b.leaf; });
  for (auto first = plan.refills.begin(); first != plan.refills.end();) {
    const NodeIndex leaf = first->leaf;
    const auto last = std::find_if(first, plan.refills.end(),
                                   [leaf](const Refill& refill) { return refill.leaf != leaf; });
    touched.push_back(leaf);
    const int num_wanted = leaves_[leaf].count() + static_cast<int>(last - first);
    if (num_wanted <= config_.max_branches) {
      for (; first != last; ++first) leaves_.append(leaf, toBranch(added[first->added]));
      continue;
    }
    std::vector<NodeIndex> reused{leaf};
    if (const NodeIndex sibling = findSharingSibling(leaf, num_wanted); sibling != kNoNode) {
      reused.push_back(sibling);
      touched.push_back(sibling);
    }
    std::vector<Branch> branches;
    for (const NodeIndex index : reused) appendBranches(leaves_[index], branches);
    for (; first != last; ++first) branches.push_back(toBranch(added[first->added]));
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

void RTree::packLeaves(std::vector<Branch> branches, const std::vector<NodeIndex>& reused,
                       Orphans& orphans) {
  const auto fewest = static_cast<std::size_t>(config_.min_branches);
  if (branches.size() < fewest) {
    orphans.cuboids.insert(orphans.cuboids.end(), branches.begin(), branches.end());
    return;
  }
  const auto most = static_cast<std::size_t>(config_.max_branches);
  std::size_t num_leaves = std::max<std::size_t>(reused.size(), 1);
  if (branches.size() > num_leaves * most) {
    const auto wanted = static_cast<std::size_t>(
        std::ceil(static_cast<double>(branches.size()) / (kNewLeafFill * config_.max_branches)));
    num_leaves = std::min(wanted, branches.size() / fewest);
  }
  std::size_t next = 0;
  std::size_t num_filled = 0;
  for (const std::size_t end : packBranches(branches, {num_leaves, fewest, most})) {
    const bool is_new = num_filled >= reused.size();
    const NodeIndex leaf = is_new ? leaves_.allocate() : reused[num_filled];
    ++num_filled;
    leaves_[leaf].clear();
    for (; next < end; ++next) leaves_.append(leaf, branches[next]);
    if (is_new) orphans.subtrees.push_back({leaf, 0});
  }
}

}  // namespace cuboid_mapping
