// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/budget.h"

#include <ros/time.h>

#include <atomic>
#include <mutex>
#include <shared_mutex>
#include <string>
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

  /// Changes the map. What the work throws is passed on: the map is then as the work has left it, its stamp
  /// as before, and takeChanges() tells that everything has changed.
  /// @param work  (CuboidMap&) -> ChangeSet. @param stamp  Of the map after it.
  template <typename WorkT>
  void change(const ros::Time& stamp, const WorkT& work) {
    const auto lock = waitFor<std::unique_lock<std::shared_mutex>>();
    noteChangesOf([&] { return work(map_); });
    stamp_ = stamp;
  }

  /// Changes the map, but not by a cloud: its stamp stays. Else as change().
  /// @param work  (CuboidMap&, const ros::Time& stamp) -> ChangeSet.
  template <typename WorkT>
  void edit(const WorkT& work) {
    const auto lock = waitFor<std::unique_lock<std::shared_mutex>>();
    noteChangesOf([&] { return work(map_, std::as_const(stamp_)); });
  }

  /// Reads the map. @param work  (const CuboidMap&, const ros::Time& stamp) -> any.
  template <typename WorkT>
  auto read(const WorkT& work) const {
    const auto lock = waitFor<std::shared_lock<std::shared_mutex>>();
    return work(std::as_const(map_), stamp_);
  }

  /// Reads the map for long: where the work lets them (Budget::spendAndYield()), others get their turn, and the map
  /// may be another one afterwards.
  /// @param work  (const CuboidMap&, const ros::Time& stamp, Budget&) -> any; the stamp is that of
  ///              the beginning.
  /// @param is_stopped  true ends the budget; may be null.
  template <typename WorkT>
  auto readInTurns(const cuboid_mapping::QueryLimits& limits, const std::atomic<bool>* is_stopped,
                   const WorkT& work) const {
    auto lock = waitFor<std::shared_lock<std::shared_mutex>>();
    const auto yield = [&] {
      lock.unlock();
      lock = waitFor<std::shared_lock<std::shared_mutex>>();
    };
    cuboid_mapping::Budget budget(limits, {yield, kTurn_s, is_stopped});
    return work(std::as_const(map_), ros::Time(stamp_), budget);
  }

  /// What the maker of the map needs to go on with it, kept with it: MapSnapshot::progress.
  /// @pre Within the work of change() or edit(), or of read().
  ///@{
  void setProgress(std::string progress) { progress_ = std::move(progress); }
  [[nodiscard]] const std::string& progress() const { return progress_; }
  ///@}

  /// Brings some of the cuboids that wait into the R-tree.
  /// @return Whether more wait.
  bool fuseSome();
  /// Brings all that wait into the R-tree, some at a time, so that others get their turn.
  void fuse();

  /// What has changed since the last call, each brick once.
  [[nodiscard]] cuboid_mapping::ChangeSet takeChanges();

  /// As above, while nobody changes the map.
  /// @param work  (const CuboidMap&, const ros::Time& stamp, const ChangeSet&). What it throws is passed on, and the
  ///              next call tells that everything has changed.
  template <typename WorkT>
  cuboid_mapping::ChangeSet takeChanges(const WorkT& work) {
    const auto lock = waitFor<std::shared_lock<std::shared_mutex>>();
    cuboid_mapping::ChangeSet changes = takeChanges();
    try {
      work(std::as_const(map_), stamp_, changes);
    } catch (...) {
      noteEverything();
      throw;
    }
    return changes;
  }

  /// Lets takeChanges() tell that everything has changed: for those who could not pass on what they took.
  void noteEverything() noexcept;

 private:
  /// A long reader has the map for so long at a time: a fifth of the time between two clouds.
  static constexpr double kTurn_s = 0.02;

  template <typename LockT>
  [[nodiscard]] LockT waitFor() const {
    const std::lock_guard<std::mutex> turn(turn_);
    return LockT(mutex_);
  }
  template <typename WorkT>
  void noteChangesOf(const WorkT& work) {
    try {
      note(work());
    } catch (...) {
      noteEverything();
      throw;
    }
  }
  void note(const cuboid_mapping::ChangeSet& changes);

  mutable std::mutex turn_;  ///< Of the one who waits for the map next.
  mutable std::shared_mutex mutex_;
  cuboid_mapping::CuboidMap map_;
  ros::Time stamp_;  ///< Of the last cloud in the map; 0 when there is none.
  std::string progress_;
  std::mutex changes_mutex_;
  bool is_everything_changed_ = false;
  std::uint64_t changed_revision_ = 0;
  cuboid_mapping::BrickTable<cuboid_mapping::ChangedBrick> changed_;
};

}  // namespace cuboid_mapping_ros
