// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/rtree/rtree.h"

#include "cuboid_mapping/rtree/quadratic_split.h"
#include "cuboid_mapping/rtree/traversal.h"

#include <algorithm>
#include <cassert>

namespace cuboid_mapping {

void RTree::reserve(std::size_t num_insertions, std::size_t num_removals) {
  const RTreeConfig& config = inner_.config();
  const auto fewest = static_cast<std::size_t>(config.min_branches);
  const std::size_t num_added = num_insertions + num_removals * (fewest - 1);
  const std::size_t num_splits =
      std::min(num_added, leaves_.size() + num_added / std::max<std::size_t>(fewest, 2) + 1);
  leaves_.reserve(num_splits + 1);
  inner_.reserve(num_splits, std::min(num_removals, leaves_.size()), leaves_.endIndex());
}

void RTree::trim() noexcept {
  leaves_.trim();
  inner_.trim();
}

void RTree::insertReserved(const Cuboid& cuboid) noexcept {
  assert(!cuboid.box.isEmpty());
  insertBranch({cuboid.box, cuboid.isOccupied(), kNoNode});
  ++size_;
}

bool RTree::removeReserved(const CellBox& box) noexcept {
  const auto found = find(box);
  if (!found) return false;
  --size_;
  Node& leaf = leaves_[found->leaf];
  leaf.remove(found->slot);
  const bool is_root = inner_.height() == 1;
  if (leaf.count() >= (is_root ? 1 : inner_.config().min_branches)) {
    inner_.update(summaryOf(found->leaf));
    return true;
  }
  BranchList orphans;
  for (int slot = 0; slot < leaf.count(); ++slot) orphans.push(leaf.branch(slot));
  inner_.remove(found->leaf);
  leaves_.release(found->leaf);
  for (const Branch& orphan : orphans) insertBranch(orphan);
  return true;
}

bool RTree::replace(const CellBox& box, const Cuboid& cuboid) noexcept {
  const auto found = find(box);
  if (!found) return false;
  leaves_[found->leaf].set(found->slot, {cuboid.box, cuboid.isOccupied(), kNoNode});
  inner_.update(summaryOf(found->leaf));
  return true;
}

void RTree::clear() noexcept { *this = RTree(inner_.config()); }

std::optional<RTree::LeafSlot> RTree::find(const CellBox& box) const {
  std::optional<LeafSlot> found;
  visitLeafSlots(*this, CellBox::ofCell(box.min), CuboidFilter::kAll,
                 [&](NodeIndex leaf, int slot) {
                   if (leaves_[leaf].box(slot) != box) return Visit::kContinue;
                   found = LeafSlot{leaf, slot};
                   return Visit::kStop;
                 });
  return found;
}

Branch RTree::summaryOf(NodeIndex leaf) const {
  Branch branch = leaves_[leaf].summary();
  branch.child = leaf;
  return branch;
}

void RTree::insertBranch(const Branch& cuboid) noexcept {
  if (inner_.isEmpty()) {
    const NodeIndex root = leaves_.allocate();
    leaves_[root].append(cuboid);
    inner_.insert(summaryOf(root));
    return;
  }
  const NodeIndex leaf = inner_.chooseLeaf(cuboid.box);
  if (leaves_[leaf].isFull()) return splitLeaf(leaf, cuboid);
  leaves_[leaf].append(cuboid);
  inner_.update(summaryOf(leaf));
}

void RTree::splitLeaf(NodeIndex leaf, const Branch& extra) noexcept {
  BranchList branches;
  for (int slot = 0; slot < leaves_[leaf].count(); ++slot) {
    branches.push(leaves_[leaf].branch(slot));
  }
  branches.push(extra);
  const SplitGroups groups = splitQuadratic(branches, inner_.config().min_branches);
  const NodeIndex sibling = leaves_.allocate();
  leaves_[leaf].clear();
  for (const Branch& branch : groups.first) leaves_[leaf].append(branch);
  for (const Branch& branch : groups.second) leaves_[sibling].append(branch);
  inner_.update(summaryOf(leaf));
  inner_.insertBeside(leaf, summaryOf(sibling));
}

}  // namespace cuboid_mapping
