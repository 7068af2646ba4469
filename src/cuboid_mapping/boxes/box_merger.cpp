// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/boxes/box_merger.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

namespace cuboid_mapping {

double countOutside(const CellBox& a, const CellBox& b) {
  return unite(a, b).numVoxels() - a.numVoxels() - b.numVoxels() + intersect(a, b).numVoxels();
}

bool isAllowed(const CellBox& both, const std::vector<CellBox>& keep_free, Budget& budget) {
  if (!budget.spendAndUnlock(keep_free.size() / kBoxesPerBrick)) return false;
  constexpr double kMostBricks = 1 << 22;
  return numBricks(both) <= kMostBricks &&
         std::none_of(keep_free.begin(), keep_free.end(),
                      [&](const CellBox& kept) { return !intersect(both, kept).isEmpty(); });
}

std::vector<CellBox> withUnion(const std::vector<CellBox>& boxes, const CellBox& both) {
  std::vector<CellBox> united{both};
  std::copy_if(boxes.begin(), boxes.end(), std::back_inserter(united),
               [&](const CellBox& box) { return !both.contains(box); });
  return united;
}

BoxMerger::BoxMerger(const std::vector<CellBox>& boxes, const std::vector<CellBox>& keep_free,
                     const CoverCost& cost, Budget& budget, CoverTest may_take)
    : boxes_(boxes),
      keep_free_(keep_free),
      cost_(cost),
      budget_(budget),
      may_take_(std::move(may_take)),
      covered_(budget, boxes),
      num_left_(boxes.size()) {}

void BoxMerger::mergeTo(std::size_t max_boxes) {
  std::size_t group_size = kGroupSize;
  while (num_left_ > max_boxes && budget_.checkClock()) {
    const std::size_t num_before = num_left_;
    makeGroups(group_size);
    const bool is_last = groups_.size() == 1;
    mergeInGroups(is_last ? max_boxes : std::max(max_boxes, num_left_ / 2));
    removeGone();
    if (num_left_ < num_before) continue;
    if (is_last) break;  // Every union would be blocked.
    group_size *= 4;
  }
}

void BoxMerger::makeGroups(std::size_t size) {
  groups_.clear();
  group_of_.assign(boxes_.size(), 0);
  std::vector<Index> all(boxes_.size());
  for (Index i = 0; i < all.size(); ++i) all[i] = i;
  splitGroup(all, size);
  for (Index group = 0; group < groups_.size(); ++group) {
    for (const Index box : groups_[group]) group_of_[box] = group;
  }
  queue_ = {};
  for (Index i = 0; i < boxes_.size(); ++i) findPartner(i);
}

/// Halves a group across its longest axis until it is small enough.
void BoxMerger::splitGroup(std::vector<Index>& group, std::size_t size) {
  if (group.size() <= size) {
    groups_.push_back(std::move(group));
    return;
  }
  CellBox hull = boxes_[group.front()];
  for (const Index box : group) hull = unite(hull, boxes_[box]);
  int axis = 0;
  for (int other = 1; other < 3; ++other) {
    if (hull.size()[other] > hull.size()[axis]) axis = other;
  }
  const auto middle = group.begin() + static_cast<std::ptrdiff_t>(group.size() / 2);
  std::nth_element(group.begin(), middle, group.end(), [&](Index a, Index b) {
    const std::int64_t center_a = std::int64_t{boxes_[a].min[axis]} + boxes_[a].max[axis];
    const std::int64_t center_b = std::int64_t{boxes_[b].min[axis]} + boxes_[b].max[axis];
    return center_a != center_b ? center_a < center_b : a < b;
  });
  std::vector<Index> upper(middle, group.end());
  group.erase(middle, group.end());
  splitGroup(group, size);
  splitGroup(upper, size);
}

/// Queues the best union of a box with another one of its group.
void BoxMerger::findPartner(Index box) {
  const CellBox mine = boxes_[box];
  std::array<std::pair<double, Index>, kExactPartners> best;
  best.fill({std::numeric_limits<double>::infinity(), box});
  for (const Index other : groups_[group_of_[box]]) {
    if (other == box || boxes_[other].isEmpty()) continue;
    const std::pair<double, Index> candidate{countOutside(mine, boxes_[other]), other};
    if (!(candidate < best.back())) continue;
    const CellBox both = unite(mine, boxes_[other]);
    const auto is_in_both = [&](const CellBox& refused) { return both.contains(refused); };
    if (!isAllowed(both, keep_free_, budget_) ||
        std::any_of(refused_.begin(), refused_.end(), is_in_both)) {
      continue;
    }
    best.back() = candidate;
    for (std::size_t i = best.size() - 1; i > 0 && best[i] < best[i - 1]; --i) {
      std::swap(best[i], best[i - 1]);
    }
  }
  Item item{std::numeric_limits<double>::infinity(), box, box};
  for (const auto& [num_outside, other] : best) {
    if (other == box) break;
    const double cost = cost_.ofBox(unite(mine, boxes_[other]), covered_);
    if (cost < item.cost) item = {cost, box, other};
  }
  if (item.second != box) queue_.push(item);
}

void BoxMerger::mergeInGroups(std::size_t max_boxes) {
  while (num_left_ > max_boxes && !queue_.empty() && budget_.spendAndUnlock()) {
    const Item item = queue_.top();
    queue_.pop();
    if (boxes_[item.first].isEmpty()) continue;
    if (boxes_[item.second].isEmpty() ||
        !mayUnite(unite(boxes_[item.first], boxes_[item.second]))) {
      findPartner(item.first);
    } else {
      merge(item.first, item.second);
    }
  }
}

bool BoxMerger::mayUnite(const CellBox& both) {
  if (!may_take_) return true;
  if (may_take_(withUnion(boxes_, both))) return true;
  refused_.push_back(both);
  return false;
}

/// The union gets a new number, so that queued unions with either of the two are recognised as outdated.
void BoxMerger::merge(Index first, Index second) {
  const CellBox both = unite(boxes_[first], boxes_[second]);
  const auto merged = static_cast<Index>(boxes_.size());
  std::vector<Index>& group = groups_[group_of_[first]];
  std::size_t num_kept = 0;
  for (const Index box : group) {
    if (boxes_[box].isEmpty()) continue;
    if (both.contains(boxes_[box])) {
      boxes_[box] = {};
      --num_left_;
    } else {
      group[num_kept++] = box;
    }
  }
  group.resize(num_kept);
  group.push_back(merged);
  group_of_.push_back(group_of_[first]);
  boxes_.push_back(both);
  covered_.add(both);
  ++num_left_;
  has_merged_ = true;
  findPartner(merged);
}

void BoxMerger::removeGone() {
  boxes_.erase(std::remove_if(boxes_.begin(), boxes_.end(),
                              [](const CellBox& box) { return box.isEmpty(); }),
               boxes_.end());
}

}  // namespace cuboid_mapping
