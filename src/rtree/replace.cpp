// SPDX-License-Identifier: BSD-3-Clause
// RTree::replace, in its steps: plan, apply to the leaves, condense, build new leaves, insert.
#include "cuboid_mapping/geometry/brick.h"
#include "cuboid_mapping/rtree/rtree.h"

#include <algorithm>
#include <cassert>

namespace cuboid_mapping {
namespace {

/// How many branches a newly built leaf gets, as a share of M: room for the bricks to change.
constexpr double kNewLeafFill = 0.75;

/// A cuboid to remove or to add, with the brick of its least cell.
template <typename ItemT>
struct Keyed {
  Cell brick;
  ItemT item;
};

template <typename ItemT>
void sortByBrick(std::vector<Keyed<ItemT>>& items) {
  std::stable_sort(items.begin(), items.end(),
                   [](const auto& a, const auto& b) { return a.brick < b.brick; });
}

}  // namespace

/// Who takes whose place.
struct RTree::ReplacePlan {
  struct Overwrite {
    LeafSlot slot;
    std::uint32_t added;
  };
  struct Refill {
    NodeIndex leaf;  ///< Leaf in which the brick had cuboids before.
    std::uint32_t added;
  };
  std::vector<Overwrite> overwrites;
  std::vector<LeafSlot> vacated;
  std::vector<Refill> refills;
  std::vector<std::uint32_t> fresh;     ///< Of bricks that lost nothing.
  std::vector<std::uint32_t> leftover;  ///< To insert through the root.
};

void RTree::replace(std::vector<LeafSlot> removed, const std::vector<Cuboid>& added) {
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
    const Cell brick = in == incoming.end() || (out != outgoing.end() && out->brick < in->brick)
                           ? out->brick
                           : in->brick;
    const bool is_fresh = out == outgoing.end() || out->brick != brick;
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
      if (is_fresh) {
        plan.fresh.push_back(in->item);
      } else {
        plan.refills.push_back({last_leaf, in->item});
      }
    }
  }

  // Bricks are sorted lexicographically here; new leaves are more compact in the caller's order.
  std::sort(plan.fresh.begin(), plan.fresh.end());
  size_ += added.size();
  size_ -= removed.size();
  condense(applyPlan(plan, added));
  buildLeaves(plan.fresh, added);
  for (const std::uint32_t i : plan.leftover) {
    insertBranch({added[i].box, added[i].log_odds, kNoNode}, 0);
  }
}

std::vector<NodeIndex> RTree::applyPlan(ReplacePlan& plan, const std::vector<Cuboid>& added) {
  std::vector<NodeIndex> touched;
  const auto branchOf = [&added](std::uint32_t i) {
    return Branch{added[i].box, added[i].log_odds, kNoNode};
  };
  for (const auto& [slot, i] : plan.overwrites) {
    leaves_[slot.leaf].set(slot.slot, branchOf(i));
    touched.push_back(slot.leaf);
  }
  // From the last slot of a leaf to the first, because a removal moves the last branch.
  std::sort(plan.vacated.begin(), plan.vacated.end(), [](const LeafSlot& a, const LeafSlot& b) {
    return a.leaf != b.leaf ? a.leaf < b.leaf : a.slot > b.slot;
  });
  for (const LeafSlot& slot : plan.vacated) {
    leaves_[slot.leaf].remove(slot.slot);
    touched.push_back(slot.leaf);
  }
  for (const auto& [leaf, i] : plan.refills) {
    if (leaves_[leaf].isFull()) {
      plan.leftover.push_back(i);
    } else {
      leaves_[leaf].append(branchOf(i));
      touched.push_back(leaf);
    }
  }
  return touched;
}

void RTree::buildLeaves(const std::vector<std::uint32_t>& fresh, const std::vector<Cuboid>& added) {
  const auto fewest = static_cast<std::size_t>(config_.min_branches);
  const auto most = static_cast<std::size_t>(config_.max_branches);
  const auto target =
      std::max(fewest, static_cast<std::size_t>(kNewLeafFill * config_.max_branches));
  std::size_t first = 0;
  while (first < fresh.size()) {
    const std::size_t rest = fresh.size() - first;
    // Leaves are the children of inner nodes: the first ones of a map go through the root.
    if (rest < fewest || height_ == 1) {
      insertBranch({added[fresh[first]].box, added[fresh[first]].log_odds, kNoNode}, 0);
      ++first;
      continue;
    }
    const std::size_t count = rest <= most ? rest : std::min(target, rest / 2);
    const NodeIndex leaf = leaves_.allocate();
    for (std::size_t i = first; i < first + count; ++i) {
      leaves_[leaf].append({added[fresh[i]].box, added[fresh[i]].log_odds, kNoNode});
    }
    Branch branch = leaves_[leaf].summary();
    branch.child = leaf;
    insertBranch(branch, 1);
    first += count;
  }
}

}  // namespace cuboid_mapping
