// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/scan_update.h"

#include "cuboid_mapping/scan/ray_walk.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace cuboid_mapping {
namespace {

// Bricks are numbered from a base that lies 2^20 bricks below the sensor, so that one number has 21
// bits on each axis. The base is aligned to the groups of 4 x 4 x 4 bricks.
constexpr int kAxisBits = 21;
constexpr std::int32_t kGroupEdge = 4 * kBrickEdge;
constexpr std::int32_t kBaseOffset = 1 << 23;

Cell baseOf(const Cell& origin) {
  Cell base;
  for (int axis = 0; axis < 3; ++axis) {
    base[axis] = (origin[axis] & ~(kGroupEdge - 1)) - kBaseOffset;
  }
  return base;
}

/// Whether a beam's end can be numbered from the base, with a brick to spare.
bool isNearBase(const Cell& base, const Cell& cell) {
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t local = static_cast<std::int64_t>(cell[axis]) - base[axis];
    if (local < kBrickEdge || local >= 2 * kBaseOffset - kBrickEdge) return false;
  }
  return true;
}

std::uint64_t packBrick(const Cell& local) {
  return static_cast<std::uint64_t>(local.x >> 3) |
         static_cast<std::uint64_t>(local.y >> 3) << kAxisBits |
         static_cast<std::uint64_t>(local.z >> 3) << (2 * kAxisBits);
}

/// Puts two zero bits before each of the 21 low bits.
std::uint64_t spreadBits(std::uint64_t value) {
  value &= 0x1FFFFF;
  value = (value | value << 32) & 0x1F00000000FFFFULL;
  value = (value | value << 16) & 0x1F0000FF0000FFULL;
  value = (value | value << 8) & 0x100F00F00F00F00FULL;
  value = (value | value << 4) & 0x10C30C30C30C30C3ULL;
  return (value | value << 2) & 0x1249249249249249ULL;
}

std::uint64_t toMorton(std::uint64_t packed) {
  return spreadBits(packed) | spreadBits(packed >> kAxisBits) << 1 |
         spreadBits(packed >> (2 * kAxisBits)) << 2;
}

Cell unpackBrick(std::uint64_t packed, const Cell& base) {
  constexpr std::uint64_t kMask = (1 << kAxisBits) - 1;
  return base + Cell{static_cast<std::int32_t>(packed & kMask) * kBrickEdge,
                     static_cast<std::int32_t>(packed >> kAxisBits & kMask) * kBrickEdge,
                     static_cast<std::int32_t>(packed >> (2 * kAxisBits) & kMask) * kBrickEdge};
}

constexpr std::uint64_t kNoKey = ~0ULL;

}  // namespace

void ScanUpdater::BrickTable::clear() {
  std::fill(slot_keys_.begin(), slot_keys_.end(), kNoKey);
  keys_.clear();
}

std::size_t ScanUpdater::BrickTable::slotOf(std::uint64_t key) const {
  constexpr std::uint64_t kGoldenRatio = 0x9E3779B97F4A7C15ULL;
  const std::size_t mask = slot_keys_.size() - 1;
  std::size_t slot = (key * kGoldenRatio) >> 32 & mask;
  while (slot_keys_[slot] != key && slot_keys_[slot] != kNoKey) slot = (slot + 1) & mask;
  return slot;
}

void ScanUpdater::BrickTable::grow() {
  const std::size_t size = std::max<std::size_t>(1024, 2 * slot_keys_.size());
  slot_keys_.assign(size, kNoKey);
  slot_indices_.resize(size);
  for (std::uint32_t index = 0; index < keys_.size(); ++index) {
    const std::size_t slot = slotOf(keys_[index]);
    slot_keys_[slot] = keys_[index];
    slot_indices_[slot] = index;
  }
}

std::uint32_t ScanUpdater::BrickTable::findOrAdd(std::uint64_t key) {
  if (2 * keys_.size() >= slot_keys_.size()) grow();
  const std::size_t slot = slotOf(key);
  if (slot_keys_[slot] == kNoKey) {
    slot_keys_[slot] = key;
    slot_indices_[slot] = static_cast<std::uint32_t>(keys_.size());
    keys_.push_back(key);
  }
  return slot_indices_[slot];
}

/// Walks through the bricks of an update and marks the misses. Copied by value into the walk.
class ScanUpdater::BrickCursor {
 public:
  BrickCursor(ScanUpdater& updater, const Ray& ray) : updater_(&updater) {
    const Cell local_end = ray.end - updater.base_;
    end_key_ = packBrick(local_end);
    end_voxel_ = voxelIndex(local_end);
    for (int axis = 0; axis < 3; ++axis) {
      const int step = ray.step[axis];
      voxel_step_[axis] = step * (1 << (3 * axis));
      axis_mask_[axis] = 7 << (3 * axis);
      last_voxel_[axis] = step > 0 ? axis_mask_[axis] : 0;
      key_step_[axis] = static_cast<std::uint64_t>(static_cast<std::int64_t>(step))
                        << (kAxisBits * axis);
    }
    const Cell local_start = ray.start - updater.base_;
    key_ = packBrick(local_start);
    voxel_ = voxelIndex(local_start);
    brick_ = &updater.brickAt(key_);
  }

  void mark() { brick_->misses[static_cast<std::size_t>(voxel_ >> 6)] |= 1ULL << (voxel_ & 63); }

  void markHit() { brick_->hits[static_cast<std::size_t>(voxel_ >> 6)] |= 1ULL << (voxel_ & 63); }

  void advance(int axis) {
    if ((voxel_ & axis_mask_[axis]) != last_voxel_[axis]) {
      voxel_ += voxel_step_[axis];
    } else {
      voxel_ ^= axis_mask_[axis];
      key_ += key_step_[axis];
      brick_ = &updater_->brickAt(key_);
    }
  }

  [[nodiscard]] bool isAtEnd() const { return voxel_ == end_voxel_ && key_ == end_key_; }

  void jumpToEnd() {
    voxel_ = end_voxel_;
    if (key_ == end_key_) return;
    key_ = end_key_;
    brick_ = &updater_->brickAt(key_);
  }

 private:
  ScanUpdater* updater_;
  BrickUpdate* brick_;
  std::uint64_t key_;
  std::uint64_t end_key_;
  int voxel_;
  int end_voxel_;
  int voxel_step_[3];
  int axis_mask_[3];
  int last_voxel_[3];
  std::uint64_t key_step_[3];
};

BrickUpdate& ScanUpdater::brickAt(std::uint64_t key) {
  const std::uint32_t index = table_.findOrAdd(key);
  if (index == update_.bricks.size()) update_.bricks.emplace_back();
  return update_.bricks[index];
}

ScanUpdater::ScanUpdater(const Grid& grid, double max_range_m)
    : grid_(grid), max_range_m_(max_range_m) {
  assert(max_range_m > 0.0);
}

void ScanUpdater::addBeam(const Scan& scan, const Eigen::Vector3f& end, bool is_return) {
  const Eigen::Vector3f beam = end - scan.origin;
  const float squared_length = beam.x() * beam.x() + beam.y() * beam.y() + beam.z() * beam.z();
  const double length_m = std::sqrt(static_cast<double>(squared_length));
  const bool is_cut = length_m > max_range_m_;
  Eigen::Vector3f last = end;
  if (is_cut) {
    // As octomath::Vector3::normalized() and octomap_server compute it.
    last = scan.origin + beam / static_cast<float>(length_m) * static_cast<float>(max_range_m_);
  }
  const auto ray = computeRay(grid_, scan.anchor_map, scan.origin, last);
  if (!ray || !isNearBase(base_, ray->end)) {
    ++update_.num_out_of_range;
    return;
  }
  ++update_.num_points;
  BrickCursor cursor = walkRay(*ray, BrickCursor(*this, *ray));
  cursor.jumpToEnd();
  if (is_cut || !is_return) {
    cursor.mark();
  } else {
    cursor.markHit();
  }
}

const ScanUpdate& ScanUpdater::compute(const Scan& scan) {
  table_.clear();
  update_ = {};
  const auto origin = grid_.toCell(scan.anchor_map + scan.origin.cast<double>());
  if (!origin) {
    update_.num_out_of_range = scan.points.size() + scan.no_returns.size();
    return update_;
  }
  base_ = baseOf(*origin);
  for (const Eigen::Vector3f& point : scan.points) addBeam(scan, point, true);
  for (const Eigen::Vector3f& end : scan.no_returns) addBeam(scan, end, false);
  sortBricks();
  return update_;
}

void ScanUpdater::sortBricks() {
  const std::vector<std::uint64_t>& keys = table_.keys();
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
  order.reserve(keys.size());
  for (std::uint32_t index = 0; index < keys.size(); ++index) {
    order.emplace_back(toMorton(keys[index]), index);
  }
  std::sort(order.begin(), order.end());
  std::vector<BrickUpdate> sorted;
  sorted.reserve(keys.size());
  for (const auto& [morton, index] : order) {
    sorted.push_back(update_.bricks[index]);
    sorted.back().brick = unpackBrick(keys[index], base_);
    sorted.back().morton = morton;
  }
  update_.bricks = std::move(sorted);
}

}  // namespace cuboid_mapping
