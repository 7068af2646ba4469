// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/clouds/forgetting.h"

#include "cuboid_mapping/map/locked_boxes.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

/// Bricks forgotten at a time: some milliseconds.
constexpr std::size_t kForgetBricks = 1000;
constexpr auto kForEver = std::numeric_limits<std::int64_t>::max();

BrickMask voxelsOf(const PackedVoxels& voxels, Forget forget) {
  switch (forget) {
    case Forget::kOccupied: return voxels.occupied();
    case Forget::kFree: return voxels.free();
    case Forget::kAll:
    case Forget::kSeenOnce: break;
  }
  return voxels.known();
}

/// Voxels of the same classes, as if each was seen once.
PackedVoxels seenOnce(const PackedVoxels& voxels, const SensorModel& model) {
  VoxelValues values;
  voxels.getValues(values);
  voxels.known().forEach([&](int voxel) {
    float& value = values[static_cast<std::size_t>(voxel)];
    value = std::clamp(value, model.miss(), model.hit());
  });
  return {voxels.known(), values};
}

/// Forgets voxels of a brick, except locked ones.
ChangeSet forgetBrick(const Cell& brick, Forget forget, CuboidMap& map) {
  const PackedVoxels* voxels = map.voxels().find(brick);
  if (voxels == nullptr) return map.replace({}, std::vector<VoxelBrick>{});
  const PackedVoxels rest =
      forget == Forget::kSeenOnce ? seenOnce(*voxels, map.sensorModel()) : PackedVoxels();
  BrickUpdate all;
  all.brick = brick;
  all.hits = voxelsOf(*voxels, forget);
  const std::vector<BrickUpdate> unlocked = map.locked().without({all});
  PackedVoxels kept = *voxels;
  for (const BrickUpdate& part : unlocked) kept.replace(part.hits, rest, kept);
  return map.replace(brickBox(brick), std::vector<VoxelBrick>{{brick, kept}});
}

}  // namespace

Forgetting::Forgetting(const NodeParameters& parameters) : forget_(parameters.forget) {
  for (const SourceParameters& source : sourcesOf(parameters)) {
    const auto time_ns = static_cast<Time>(1e9 * source.forget_after_s);
    times_ns_.push_back(time_ns);
    if (time_ns > 0 && (!isOn() || time_ns < shortest_ns_)) shortest_ns_ = time_ns;
  }
  doubted_.resize(times_ns_.size());
}

void Forgetting::note(const ScanUpdate& update, const ros::Time& stamp, std::size_t source) {
  if (!isOn() || stamp.isZero()) return;
  const Time time = clock_.note(static_cast<Time>(stamp.toNSec()), source);
  std::vector<Cell> bricks;
  for (const BrickUpdate& brick : update.bricks) bricks.push_back(brick.brick);
  std::vector<Cell>& doubted = doubted_.at(source);
  remember(doubted, source, time);
  remember(bricks, source, time);
  doubted = clock_.isBelieved(source) ? std::vector<Cell>() : std::move(bricks);
  findDue();
}

void Forgetting::remember(const std::vector<Cell>& bricks, std::size_t source, Time time) {
  const Time time_ns = times_ns_.at(source);
  const Time until = time_ns == 0 ? kForEver : time + time_ns;
  for (const Cell& brick : bricks) {
    Time& remembered = remembered_[brick];
    remembered = std::max(remembered, until);
  }
}

void Forgetting::findDue() {
  const Time now = clock_.now_ns();
  if (now <= last_sweep_ + shortest_ns_ / 10) return;
  for (std::size_t source = 0; source < doubted_.size(); ++source) {
    remember(doubted_[source], source, now);
  }
  for (const auto& [brick, until] : remembered_) {
    if (until < now) due_.push_back(brick);
  }
  last_sweep_ = now;
}

ChangeSet Forgetting::forgetSome(CuboidMap& map) {
  ChangeSet changes;
  changes.revision = map.revision();
  for (std::size_t count = 0; count < kForgetBricks && hasDue(); ++count, due_.pop_back()) {
    const auto remembered = remembered_.find(due_.back());
    if (remembered == remembered_.end() || clock_.now_ns() <= remembered->second) continue;
    const ChangeSet change = forgetBrick(due_.back(), forget_, map);
    changes.bricks.insert(changes.bricks.end(), change.bricks.begin(), change.bricks.end());
    changes.is_everything = changes.is_everything || change.is_everything;
    changes.revision = change.revision;
    remembered_.erase(remembered);
  }
  return changes;
}

Forgetting Forgetting::moved(const VoxelMotion& motion) const {
  Forgetting other = *this;
  other.remembered_.clear();
  other.due_.clear();
  for (const auto& entry : remembered_) {
    forEachBrick(motion(brickBox(entry.first)), [&](const Cell& brick) {
      Time& until = other.remembered_[brick];
      until = std::max(until, entry.second);
    });
  }
  for (std::vector<Cell>& bricks : other.doubted_) {
    for (const Cell& old : std::exchange(bricks, {})) {
      forEachBrick(motion(brickBox(old)), [&](const Cell& brick) { bricks.push_back(brick); });
    }
  }
  return other;
}

}  // namespace cuboid_mapping_ros
