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
/// Whoever changes the map has it alone, for one cloud or for a few groups of bricks that are
/// written back, which takes milliseconds; readers share it. Waiting is in turn, so that neither a
/// row of small changes nor a row of readers keeps somebody out.
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

  /// Reads what is in the R-tree. @param work  (const CuboidMap&, const ros::Time& stamp) -> any.
  template <typename WorkT>
  auto read(const WorkT& work) const {
    const auto lock = waitFor<std::shared_lock<std::shared_mutex>>();
    return work(std::as_const(map_), stamp_);
  }

  /// Reads a region as the last cloud has left it: one revision, nothing waits to be written back.
  /// @param work  As in read().
  template <typename WorkT>
  auto readCurrent(const cuboid_mapping::CellBox& region, const WorkT& work) {
    flush(region);
    {
      const auto lock = waitFor<std::shared_lock<std::shared_mutex>>();
      if (map_.isFlushed(region)) return work(std::as_const(map_), stamp_);
    }
    const auto lock = waitFor<std::unique_lock<std::shared_mutex>>();  // A cloud came in between.
    note(map_.flush(region));
    return work(std::as_const(map_), stamp_);
  }

  /// Writes hot bricks of a region back, a few at a time.
  void flush(const cuboid_mapping::CellBox& region = cuboid_mapping::kAllCells);

  /// What has changed in the R-tree since the last call.
  [[nodiscard]] cuboid_mapping::ChangeSet takeChanges();

 private:
  template <typename LockT>
  [[nodiscard]] LockT waitFor() const {
    const std::lock_guard<std::mutex> turn(turn_);
    return LockT(mutex_);
  }
  void note(cuboid_mapping::ChangeSet changes);

  mutable std::mutex turn_;  ///< Of the one who waits for the map next.
  mutable std::shared_mutex mutex_;
  cuboid_mapping::CuboidMap map_;
  ros::Time stamp_;  ///< Of the last cloud in the map; 0 when there is none.
  std::mutex changes_mutex_;
  cuboid_mapping::ChangeSet changes_;
};

}  // namespace cuboid_mapping_ros
