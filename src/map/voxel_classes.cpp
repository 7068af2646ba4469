// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/voxel_classes.h"

#include <algorithm>

namespace cuboid_mapping {
namespace {

constexpr std::size_t kFirstEntries = 64;

BrickMask fullMask() {
  BrickMask mask;
  mask.fill(~0ULL);
  return mask;
}

}  // namespace

void VoxelClasses::clear() {
  entries_.assign(kFirstEntries, Entry());
  entries_.shrink_to_fit();
  num_bricks_ = 0;
  blocks_.clear();
  free_masks_.clear();
  num_masks_ = 2;
  blocks_.push_back(std::make_unique<BrickMask[]>(kBlockMasks));
  blocks_[0][kNothing] = {};
  blocks_[0][kEverything] = fullMask();
}

void VoxelClasses::grow() {
  std::vector<Entry> old(2 * entries_.size());
  old.swap(entries_);
  for (const Entry& entry : old) {
    if (entry.known != kNoMask) entries_[slotOf(entry.brick)] = entry;
  }
}

/// Where a mask is kept. @param index  Where the brick's was until now, or kNoMask.
VoxelClasses::MaskIndex VoxelClasses::store(MaskIndex index, const BrickMask& mask) {
  const bool has_own_place = index != kNoMask && index != kNothing && index != kEverything;
  const bool is_nothing = mask == BrickMask{};
  if (is_nothing || mask == fullMask()) {
    if (has_own_place) free_masks_.push_back(index);
    return is_nothing ? kNothing : kEverything;
  }
  if (!has_own_place) {
    if (!free_masks_.empty()) {
      index = free_masks_.back();
      free_masks_.pop_back();
    } else {
      index = num_masks_++;
      if (index / kBlockMasks == blocks_.size()) {
        blocks_.push_back(std::make_unique<BrickMask[]>(kBlockMasks));
      }
    }
  }
  blocks_[index / kBlockMasks][index % kBlockMasks] = mask;
  return index;
}

void VoxelClasses::set(const Cell& brick, const BrickMask& known, const BrickMask& occupied) {
  if (2 * (num_bricks_ + 1) > entries_.size()) grow();
  Entry& entry = entries_[slotOf(brick)];
  if (entry.known == kNoMask) ++num_bricks_;
  entry.brick = brick;
  entry.known = store(entry.known, known);
  entry.occupied = store(entry.occupied, occupied);
}

void VoxelClasses::fill(const CellBox& box, Occupancy occupancy) {
  (void)anyBrick(box, [&](const Cell& brick) {
    Masks masks{};
    const bool is_there = find(brick, masks);
    if (!is_there && occupancy == Occupancy::kUnknown) return false;
    BrickMask known = is_there ? *masks.known : BrickMask{};
    BrickMask occupied = is_there ? *masks.occupied : BrickMask{};
    const CellBox part = intersect(box, brickBox(brick));
    const std::uint64_t slice = sliceMask(part);
    for (std::int32_t z = part.min.z; z < part.max.z; ++z) {
      const auto at = static_cast<std::size_t>(z & 7);
      known[at] = occupancy == Occupancy::kUnknown ? known[at] & ~slice : known[at] | slice;
      occupied[at] =
          occupancy == Occupancy::kOccupied ? occupied[at] | slice : occupied[at] & ~slice;
    }
    set(brick, known, occupied);
    return false;  // On to the next.
  });
}

bool VoxelClasses::isAnyOccupied(const CellBox& box) const {
  return anyBrick(box, [&](const Cell& brick) {
    const Entry& entry = entries_[slotOf(brick)];
    if (entry.known == kNoMask || entry.occupied == kNothing) return false;
    const CellBox part = intersect(box, brickBox(brick));
    const std::uint64_t slice = sliceMask(part);
    const BrickMask& occupied = mask(entry.occupied);
    for (std::int32_t z = part.min.z; z < part.max.z; ++z) {
      if ((occupied[static_cast<std::size_t>(z & 7)] & slice) != 0) return true;
    }
    return false;
  });
}

bool VoxelClasses::isAll(const CellBox& box, Occupancy occupancy) const {
  const bool wants_occupied = occupancy == Occupancy::kOccupied;
  return !anyBrick(box, [&](const Cell& brick) {
    const Entry& entry = entries_[slotOf(brick)];
    if (entry.known == kNoMask) return true;
    if (entry.known == kEverything && entry.occupied == (wants_occupied ? kEverything : kNothing)) {
      return false;
    }
    const CellBox part = intersect(box, brickBox(brick));
    const std::uint64_t slice = sliceMask(part);
    const BrickMask& known = mask(entry.known);
    const BrickMask& occupied = mask(entry.occupied);
    for (std::int32_t z = part.min.z; z < part.max.z; ++z) {
      const auto at = static_cast<std::size_t>(z & 7);
      const std::uint64_t wanted = known[at] & (wants_occupied ? occupied[at] : ~occupied[at]);
      if ((slice & ~wanted) != 0) return true;
    }
    return false;
  });
}

std::size_t VoxelClasses::numBytes() const {
  return entries_.capacity() * sizeof(Entry) + blocks_.size() * kBlockMasks * sizeof(BrickMask) +
         blocks_.capacity() * sizeof(blocks_[0]) + free_masks_.capacity() * sizeof(MaskIndex);
}

}  // namespace cuboid_mapping
