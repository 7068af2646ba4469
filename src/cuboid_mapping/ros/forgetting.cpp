// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/forgetting.h"

#include "cuboid_mapping/ros/time_jump.h"

#include <vector>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::BrickMask;
using cuboid_mapping::BrickUpdate;
using cuboid_mapping::Cell;
using cuboid_mapping::ChangeSet;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::PackedVoxels;

BrickMask voxelsOf(const PackedVoxels& voxels, ForgetClass of_class) {
  switch (of_class) {
    case ForgetClass::kAll: return voxels.known();
    case ForgetClass::kOccupied: return voxels.occupied();
    case ForgetClass::kFree: break;
  }
  return voxels.free();
}

/// Makes the voxels of a brick unknown that are of a class, but for those that are locked.
ChangeSet forgetBrick(const Cell& brick, ForgetClass of_class, CuboidMap& map) {
  const PackedVoxels* voxels = map.voxels().find(brick);
  if (voxels == nullptr) return map.replace({}, std::vector<cuboid_mapping::VoxelBrick>{});
  BrickUpdate all;
  all.brick = brick;
  all.hits = voxelsOf(*voxels, of_class);
  const std::vector<BrickUpdate> unlocked = map.locked().without({all});
  PackedVoxels kept = *voxels;
  for (const BrickUpdate& part : unlocked) kept.replace(part.hits, PackedVoxels(), kept);
  return map.replace(cuboid_mapping::brickBox(brick),
                     std::vector<cuboid_mapping::VoxelBrick>{{brick, kept}});
}

}  // namespace

void Forgetting::note(const cuboid_mapping::ScanUpdate& update, const ros::Time& stamp) {
  if (after_.isZero() || stamp.isZero()) return;
  if (isOlder(stamp, now_, after_)) {
    for (auto& [brick, seen] : seen_) seen = stamp;
    last_sweep_ = stamp;
  }
  now_ = stamp;
  for (const BrickUpdate& brick : update.bricks) seen_[brick.brick] = stamp;
}

ChangeSet Forgetting::forget(CuboidMap& map) {
  ChangeSet changes;
  changes.revision = map.revision();
  const ros::Duration period = after_ * 0.1;
  if (after_.isZero() || !isOlder(last_sweep_, now_, period)) return changes;
  for (auto brick = seen_.begin(); brick != seen_.end();) {
    if (!isOlder(brick->second, now_, after_)) {
      ++brick;
      continue;
    }
    const ChangeSet change = forgetBrick(brick->first, class_, map);
    changes.bricks.insert(changes.bricks.end(), change.bricks.begin(), change.bricks.end());
    changes.is_everything = changes.is_everything || change.is_everything;
    changes.revision = change.revision;
    brick = seen_.erase(brick);
  }
  last_sweep_ = now_;
  return changes;
}

}  // namespace cuboid_mapping_ros
