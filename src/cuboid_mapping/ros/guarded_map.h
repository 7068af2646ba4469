// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"

#include <ros/time.h>

#include <mutex>
#include <shared_mutex>
#include <utility>

namespace cuboid_mapping_ros {

/// A map that one thread fills while others look at it. Thread-safe.
///
/// Whoever changes the map has it alone, for one cloud, or for some bricks that are fused, which
/// takes milliseconds; readers share it, and see it as the last change has left it. Waiting is in
/// turn, so that neither a row of small changes nor a row of readers keeps somebody out.
class GuardedMap {
 public:
  explicit GuardedMap(const cuboid_mapping::MapConfig& config) : map_(config) {}

  [[nodiscard]] const cuboid_mapping::Grid& grid() const { return map_.grid(); }

  /// Changes the map. @param work  (CuboidMap&) -> ChangeSet.
  /// @param stamp  Of the map after it.
  template <typename WorkT>
  void change(const ros::Time& stamp, const WorkT& work) {
    const auto lock = waitFor<std::unique_lock<std::shared_mutex>>();
    stamp_ = stamp;
    note(work(map_));
  }

  /// Changes the map, but not by a cloud: its stamp stays.
  /// @param work  (CuboidMap&, const ros::Time& stamp) -> ChangeSet.
  template <typename WorkT>
  void edit(const WorkT& work) {
    const auto lock = waitFor<std::unique_lock<std::shared_mutex>>();
    note(work(map_, std::as_const(stamp_)));
  }

  /// Reads the map. @param work  (const CuboidMap&, const ros::Time& stamp) -> any.
  template <typename WorkT>
  auto read(const WorkT& work) const {
    const auto lock = waitFor<std::shared_lock<std::shared_mutex>>();
    return work(std::as_const(map_), stamp_);
  }

  /// Brings some of the cuboids that wait into the R-tree.
  /// @return Whether more wait.
  bool fuseSome();
  /// Brings all that wait into the R-tree, some at a time, so that others get their turn.
  void fuse();

  /// What has changed since the last call, each brick once.
  [[nodiscard]] cuboid_mapping::ChangeSet takeChanges();

 private:
  template <typename LockT>
  [[nodiscard]] LockT waitFor() const {
    const std::lock_guard<std::mutex> turn(turn_);
    return LockT(mutex_);
  }
  void note(const cuboid_mapping::ChangeSet& changes);

  mutable std::mutex turn_;  ///< Of the one who waits for the map next.
  mutable std::shared_mutex mutex_;
  cuboid_mapping::CuboidMap map_;
  ros::Time stamp_;  ///< Of the last cloud in the map; 0 when there is none.
  std::mutex changes_mutex_;
  bool is_everything_changed_ = false;
  std::uint64_t changed_revision_ = 0;
  cuboid_mapping::BrickTable<cuboid_mapping::ChangedBrick> changed_;
};

}  // namespace cuboid_mapping_ros
