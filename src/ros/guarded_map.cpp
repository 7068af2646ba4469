// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/guarded_map.h"

namespace cuboid_mapping_ros {
namespace {

/// Groups of bricks that are written back at a time: one or two milliseconds.
constexpr std::size_t kFlushGroups = 16;

}  // namespace

void GuardedMap::flush(const cuboid_mapping::CellBox& region) {
  const auto is_flushed = [&] {
    return read([&](const auto& map, const ros::Time& /*stamp*/) { return map.isFlushed(region); });
  };
  // More turns than there are groups in a cache would mean that clouds come faster than this goes.
  constexpr int kMaxTurns = 10000;
  for (int turn = 0; turn < kMaxTurns && !is_flushed(); ++turn) {
    const auto lock = waitFor<std::unique_lock<std::shared_mutex>>();
    note(map_.flush(region, kFlushGroups));
  }
}

void GuardedMap::note(cuboid_mapping::ChangeSet changes) {
  const std::lock_guard<std::mutex> lock(changes_mutex_);
  if (changes.is_everything) {
    changes_ = std::move(changes);
    return;
  }
  changes_.revision = changes.revision;
  if (changes_.is_everything) return;
  changes_.boxes.insert(changes_.boxes.end(), changes.boxes.begin(), changes.boxes.end());
}

cuboid_mapping::ChangeSet GuardedMap::takeChanges() {
  const std::lock_guard<std::mutex> lock(changes_mutex_);
  return std::exchange(changes_, {});
}

}  // namespace cuboid_mapping_ros
