// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/guarded_map.h"

#include <new>

namespace cuboid_mapping_ros {
namespace {

/// Bricks that are fused at a time: about a millisecond.
constexpr std::size_t kFuseBricks = 256;

/// Changed bricks of which nothing is left in the map, as after edits, that are remembered. With more
/// of them to tell that everything has changed is shorter.
constexpr std::size_t kMaxGoneBricks = 100000;

}  // namespace

bool GuardedMap::fuseSome() {
  const auto lock = waitFor<std::unique_lock<std::shared_mutex>>();
  return !map_.fuse(kFuseBricks);
}

void GuardedMap::fuse() {
  // More turns would mean that clouds come faster than this goes.
  constexpr int kMaxTurns = 10000;
  for (int turn = 0; turn < kMaxTurns && fuseSome(); ++turn) {
  }
}

void GuardedMap::note(const cuboid_mapping::ChangeSet& changes) {
  const std::lock_guard<std::mutex> lock(changes_mutex_);
  changed_revision_ = changes.revision;
  if (changes.is_everything) {
    is_everything_changed_ = true;
    changed_.clear();
  }
  if (is_everything_changed_) return;
  try {
    for (const cuboid_mapping::ChangedBrick& brick : changes.bricks) {
      changed_.at(brick.brick).has_new_cuboids |= brick.has_new_cuboids;
    }
  } catch (const std::bad_alloc&) {  // The map has changed: nobody may miss it.
    is_everything_changed_ = true;
    changed_.clear();
  }
  if (changed_.size() <= kMaxGoneBricks + map_.voxels().size()) return;
  is_everything_changed_ = true;
  changed_.clear();
}

void GuardedMap::noteEverything() noexcept {
  const std::lock_guard<std::mutex> lock(changes_mutex_);
  is_everything_changed_ = true;
  changed_.clear();
}

cuboid_mapping::ChangeSet GuardedMap::takeChanges() {
  const std::lock_guard<std::mutex> lock(changes_mutex_);
  cuboid_mapping::ChangeSet changes{changed_revision_, is_everything_changed_, {}};
  changes.bricks.reserve(changed_.size());
  changed_.forEach([&changes](const auto& brick) { changes.bricks.push_back(brick); });
  changed_.clear();
  is_everything_changed_ = false;
  return changes;
}

}  // namespace cuboid_mapping_ros
