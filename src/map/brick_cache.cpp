// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/brick_cache.h"

#include <algorithm>
#include <cassert>

namespace cuboid_mapping {

HotGroup& BrickCache::touch(const Cell& group, std::uint64_t cloud) {
  const auto found = by_cell_.find(group);
  if (found != by_cell_.end()) {
    groups_.splice(groups_.begin(), groups_, found->second);
  } else {
    groups_.emplace_front();
    groups_.front().group = group;
    by_cell_.emplace(group, groups_.begin());
  }
  groups_.front().last_cloud = cloud;
  return groups_.front();
}

DenseBrick& BrickCache::add(HotGroup& group, const Cell& brick) {
  std::unique_ptr<DenseBrick>& place = group.bricks[indexInGroup(brick)];
  assert(place == nullptr);
  place = std::make_unique<DenseBrick>();
  place->brick = brick;
  ++num_bricks_;
  return *place;
}

void BrickCache::remove(const Cell& group) {
  const auto found = by_cell_.find(group);
  assert(found != by_cell_.end());
  const auto& bricks = found->second->bricks;
  num_bricks_ -= static_cast<std::size_t>(std::count_if(
      bricks.begin(), bricks.end(), [](const auto& brick) { return brick != nullptr; }));
  groups_.erase(found->second);
  by_cell_.erase(found);
}

void BrickCache::remove(const CellBox& region) {
  for (HotGroup& group : groups_) {
    const CellBox box{group.group, group.group + Cell{kGroupEdge, kGroupEdge, kGroupEdge}};
    if (intersect(box, region).isEmpty()) continue;
    for (std::size_t i = 0; i < kGroupBricks; ++i) {
      auto& brick = group.bricks[i];
      if (brick == nullptr || intersect(brickBox(brick->brick), region).isEmpty()) continue;
      brick.reset();
      group.is_dirty &= ~(std::uint64_t{1} << i);
      --num_bricks_;
    }
  }
}

void BrickCache::clear() {
  by_cell_ = decltype(by_cell_)();
  groups_.clear();
  num_bricks_ = 0;
}

std::size_t BrickCache::numBytes() const {
  // A node of the list has two pointers, one of the table a pointer, a hash and the pair.
  constexpr std::size_t kGroupBytes = sizeof(HotGroup) + 2 * sizeof(void*) + 2 * sizeof(void*) +
                                      sizeof(std::pair<const Cell, Groups::iterator>);
  return num_bricks_ * sizeof(DenseBrick) + groups_.size() * kGroupBytes +
         by_cell_.bucket_count() * sizeof(void*);
}

}  // namespace cuboid_mapping
