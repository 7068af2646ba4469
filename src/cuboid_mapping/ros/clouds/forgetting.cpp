// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/clouds/forgetting.h"

#include <algorithm>
#include <limits>
#include "cuboid_mapping/map/locked_boxes.h"

namespace cuboid_mapping_ros {
namespace {

/// Bricks forgotten at a time: some milliseconds.
constexpr std::size_t kForgetBricks = 1000;
constexpr auto kForEver = std::numeric_limits<std::uint64_t>::max();

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
}

void Forgetting::note(const ScanUpdate& update, const ros::Time& stamp, std::size_t source) {
  if (!isOn() || stamp.isZero()) return;
  const Time now = stamp.toNSec();
  if (now + shortest_ns_ < now_) jumpBack(now);
  now_ = now;
  const Time time_ns = times_ns_.at(source);
  const Time until = time_ns == 0 ? kForEver : now + time_ns;
  for (const BrickUpdate& brick : update.bricks) {
    Time& remembered = remembered_[brick.brick];
    remembered = std::max(remembered, until);
  }
  findDue();
}

void Forgetting::jumpBack(Time to) {
  for (auto& [brick, until] : remembered_) {
    if (until != kForEver) until = to + (std::max(until, now_) - now_);
  }
  last_sweep_ = to;
}

void Forgetting::findDue() {
  if (now_ <= last_sweep_ + shortest_ns_ / 10) return;
  for (const auto& [brick, until] : remembered_) {
    if (until < now_) due_.push_back(brick);
  }
  last_sweep_ = now_;
}

ChangeSet Forgetting::forgetSome(CuboidMap& map) {
  ChangeSet changes;
  changes.revision = map.revision();
  for (std::size_t count = 0; count < kForgetBricks && hasDue(); ++count, due_.pop_back()) {
    const auto remembered = remembered_.find(due_.back());
    if (remembered == remembered_.end() || now_ <= remembered->second) continue;
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
  return other;
}

}  // namespace cuboid_mapping_ros
