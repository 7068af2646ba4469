// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/budget.h"
#include "cuboid_mapping/ros/map/edit_undo.h"
#include "cuboid_mapping/ros/map/kept_history.h"
#include "cuboid_mapping/ros/map/phase_fair_mutex.h"
#include "cuboid_mapping/voxels/brick_table.h"
#include "cuboid_mapping/window/map_window.h"

#include <ros/time.h>

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

namespace cuboid_mapping_ros {

/// As long as it lives, no part of a map leaves the memory.
class PageHold {
 public:
  explicit PageHold(std::atomic<int>& count) : count_(count) { ++count_; }
  ~PageHold() { --count_; }
  PageHold(const PageHold&) = delete;
  PageHold& operator=(const PageHold&) = delete;

 private:
  std::atomic<int>& count_;
};

/// Gives a map that was built beside another one the sensor model of that one, which may have been reconfigured meanwhile.
void followSensorModel(const cuboid_mapping::CuboidMap& map, cuboid_mapping::CuboidMap& fresh);

/// A map that one thread fills while others look at it. Thread-safe.
///
/// A writer has the map alone for milliseconds, to commit a cloud or to fuse some bricks. Readers
/// share it, and see the last committed change. While the change of a cloud is computed, readers go
/// on. Many small changes or many readers keep nobody out, and a long reader blocks no other one:
/// see PhaseFairMutex.
class GuardedMap {
 public:
  explicit GuardedMap(const cuboid_mapping::MapConfig& config) : map_(config) {}

  [[nodiscard]] const cuboid_mapping::Grid& grid() const { return map_.grid(); }

  /// From now on a window of the map stays in memory. To be called before others use the map.
  void setWindow(std::unique_ptr<cuboid_mapping::MapWindow> window) { window_ = std::move(window); }

  /// From now on what happens to the map is kept, too; it must have the whole map. Before others use the map.
  void setHistory(std::unique_ptr<KeptHistory> history) { history_ = std::move(history); }
  /// Null where nothing is kept.
  [[nodiscard]] KeptHistory* history() const { return history_.get(); }

  /// Puts what a cloud has seen into the map: what lies outside the window comes back before, or is left out, as the
  /// window has it. Else as change(); readers go on while it is worked out what becomes of the voxels.
  /// @param model  Of the sensor, see CuboidMap::apply(). @param window_center_map  Not looked at without a window.
  /// @param kept  For the history, where there is one.
  void integrate(const ros::Time& stamp, const cuboid_mapping::ScanUpdate& update,
                 const cuboid_mapping::SensorModel& model, const Eigen::Vector3d& window_center_map,
                 const std::optional<KeptObservation>& kept = std::nullopt);

  /// Begins a correction of the map as it is. Clouds wait while the map is copied, some milliseconds.
  /// @pre There is a history. @throws As MapHistory::begin(), and KeptHistory::whole().
  [[nodiscard]] cuboid_mapping::MapCorrection beginCorrection(
      const cuboid_mapping::PoseTrack& poses, const cuboid_mapping::CorrectionRule& rule);
  /// Puts a corrected map, and the poses in it, in the place of the map. Else as replaceAll().
  /// @pre There is a history. @throws As MapHistory::finish(), and KeptHistory::whole(): all is then as it was.
  void exchange(cuboid_mapping::MapCorrection& correction);

  /// Changes voxels of a box, which are brought back before. Else as edit().
  /// @param whole  Not empty: box of an edit in parts, for the history.
  /// @throws cuboid_mapping::MapFileError  where they cannot be: no voxel has changed, and those before it are there.
  template <typename WorkT>
  void editIn(const cuboid_mapping::CellBox& box, const WorkT& work,
              const cuboid_mapping::CellBox& whole = {}) {
    const ChangeLock lock(*this);
    if (window_) noteGathered([&](auto& changes) { window_->load(box, map_, changes); });
    noteChangesOf([&] {
      cuboid_mapping::ChangeSet changes = work(map_, std::as_const(stamp_));
      if (window_) window_->note(changes);
      return changes;
    });
    if (history_) history_->addEdit(box, map_, whole);
  }

  /// Puts another map in the place of the whole one, in memory and on disk. Else as edit(), and the stamp may be set.
  /// @param work  (CuboidMap&, ros::Time& stamp) -> ChangeSet.
  template <typename WorkT>
  void replaceAll(const WorkT& work) {
    const ChangeLock lock(*this);
    noteReplaced();
    noteChangesOf([&] { return work(map_, stamp_); });
    if (history_) history_->restart(map_);
    if (window_) window_->noteReplaced(map_);
  }

  /// Changes the map. What the work throws is passed on: the map is then as the work has left it, its stamp
  /// as before, and takeChanges() tells that everything has changed.
  /// @param work  (CuboidMap&) -> ChangeSet. @param stamp  Of the map after it.
  template <typename WorkT>
  void change(const ros::Time& stamp, const WorkT& work) {
    const ChangeLock lock(*this);
    noteChangesOf([&] { return work(map_); });
    stamp_ = stamp;
  }

  /// Changes the map, but not by a cloud: its stamp stays. A history keeps the locks. Else as change().
  /// @param work  (CuboidMap&, const ros::Time& stamp) -> ChangeSet.
  template <typename WorkT>
  void edit(const WorkT& work) {
    const ChangeLock lock(*this);
    noteChangesOf([&] { return work(map_, std::as_const(stamp_)); });
    if (history_) history_->addEdit({}, map_);
  }

  /// Begins an edit that undoEdit() undoes: calls of edit() and editIn() with keepForUndo(), as long as the turn lives.
  /// Edits wait for each other, so that the last one is undone exactly.
  [[nodiscard]] std::unique_lock<std::mutex> beginEdit();
  /// Keeps the voxels of a box, and the locks, before they change. @pre Within the work of an edit that has begun.
  void keepForUndo(const cuboid_mapping::CellBox& box) { undo_.keep(map_, box); }
  /// Restores the voxels and locks that the last edit replaced, also where clouds have changed them since; see EditUndo.
  /// @return Number of edits that can still be undone; nothing when there was none.
  /// @throws std::bad_alloc, cuboid_mapping::MapFileError  The next call undoes the rest of the edit.
  std::optional<std::size_t> undoEdit();

  /// Reads the map. @param work  (const CuboidMap&, const ros::Time& stamp) -> any.
  template <typename WorkT>
  auto read(const WorkT& work) const {
    const ReadLock lock(mutex_);
    return work(std::as_const(map_), stamp_);
  }

  /// As read(), with the window: null where all of the map is in memory.
  /// @param work  (const CuboidMap&, const ros::Time& stamp, const MapWindow*) -> any.
  template <typename WorkT>
  auto readWithWindow(const WorkT& work) const {
    const ReadLock lock(mutex_);
    return work(std::as_const(map_), stamp_,
                static_cast<const cuboid_mapping::MapWindow*>(window_.get()));
  }

  /// Reads the map for long: where the work lets them (Budget::spendAndYield()), others get their turn, and the map
  /// may be another one afterwards.
  /// @param work  (const CuboidMap&, const ros::Time& stamp, Budget&) -> any; the stamp is that of
  ///              the beginning.
  /// @param is_stopped  true ends the budget; may be null.
  template <typename WorkT>
  auto readInTurns(const cuboid_mapping::QueryLimits& limits, const std::atomic<bool>* is_stopped,
                   const WorkT& work) const {
    ReadLock lock(mutex_);
    const auto yield = [&lock] { lock.yield(); };
    cuboid_mapping::Budget budget(limits, {yield, kTurn_s, is_stopped});
    return work(std::as_const(map_), ros::Time(stamp_), budget);
  }

  /// State of the map's maker, kept with the map: MapSnapshot::progress.
  /// @pre Within the work of change() or edit(), or of read().
  ///@{
  void setProgress(std::string progress) { progress_ = std::move(progress); }
  [[nodiscard]] const std::string& progress() const { return progress_; }
  ///@}

  /// Calls of replaceAll() so far. @pre Within the work of read().
  [[nodiscard]] std::uint64_t numReplaced() const { return num_replaced_; }

  /// Pages in memory, and pages that are read, stay there as long as the hold lives.
  [[nodiscard]] PageHold hold() { return PageHold(num_holds_); }
  /// Pages of a box that are on disk only; always 0 without a window. @complexity O(pages of the box).
  [[nodiscard]] std::size_t countNotLoaded(const cuboid_mapping::CellBox& box) const;
  /// Region of a search without one: the window if parts of the map are on disk only, else everything.
  [[nodiscard]] std::optional<cuboid_mapping::CellBox> regionOfSearch() const;
  /// Brings them back, some at a time, so that others get their turn.
  /// @throws cuboid_mapping::MapFileError  where one cannot be: those before it are there.
  void load(const cuboid_mapping::CellBox& box);
  /// Nothing without a window.
  [[nodiscard]] std::optional<cuboid_mapping::WindowFigures> windowFigures() const;
  /// Writes what has changed to the disk, some pages at a time, so that others get their turn. Failures are in the figures
  /// of the window.
  void save();
  /// Takes the sensor model of the map into the store.
  void saveHead();

  /// Changed bricks since the last call, each once.
  [[nodiscard]] cuboid_mapping::ChangeSet takeChanges();

  /// As above, while nobody changes the map.
  /// @param work  (const CuboidMap&, const ros::Time& stamp, const ChangeSet&). What it throws is passed on, and the
  ///              next call tells that everything has changed.
  template <typename WorkT>
  cuboid_mapping::ChangeSet takeChanges(const WorkT& work) {
    const ReadLock lock(mutex_);
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

  using WriteLock = std::lock_guard<PhaseFairMutex>;

  /// Shares the map with others who read.
  class ReadLock {
   public:
    explicit ReadLock(PhaseFairMutex& mutex) : mutex_(mutex), generation_(mutex.lockShared()) {}
    ~ReadLock() { mutex_.unlockShared(generation_); }
    ReadLock(const ReadLock&) = delete;
    ReadLock& operator=(const ReadLock&) = delete;

    void yield() {
      mutex_.unlockShared(generation_);
      generation_ = mutex_.lockShared();
    }

   private:
    PhaseFairMutex& mutex_;
    int generation_;
  };

  void noteReplaced() {
    ++num_replaced_;
    undo_.clear();
  }
  [[nodiscard]] std::unique_lock<std::mutex> waitToChange() const {
    const std::lock_guard<std::mutex> turn(change_turn_);
    return std::unique_lock<std::mutex>(change_);
  }
  /// Has the map alone.
  class ChangeLock {
   public:
    explicit ChangeLock(const GuardedMap& map) : change_(map.waitToChange()), alone_(map.mutex_) {}

   private:
    std::unique_lock<std::mutex> change_;
    WriteLock alone_;
  };

  /// @param work  (ChangeSet& changes): puts there what has changed so far, also when it throws.
  template <typename WorkT>
  void noteGathered(const WorkT& work) {
    cuboid_mapping::ChangeSet changes{map_.revision(), false, {}};
    try {
      work(changes);
    } catch (...) {
      note(changes);
      throw;
    }
    note(changes);
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
  [[nodiscard]] const cuboid_mapping::ScanUpdate& admit(const cuboid_mapping::ScanUpdate& update,
                                                        const Eigen::Vector3d& window_center_map);

  mutable std::mutex change_;  ///< Held by the thread that changes the map or prepares a change.
  mutable std::mutex change_turn_;  ///< Held by the thread that is next.
  mutable PhaseFairMutex mutex_;    ///< Written by whoever has `change_`.
  cuboid_mapping::CuboidMap map_;
  std::unique_ptr<cuboid_mapping::MapWindow> window_;  ///< May be null.
  std::unique_ptr<KeptHistory> history_;               ///< May be null.
  std::atomic<int> num_holds_{0};
  std::uint64_t num_replaced_ = 0;
  std::mutex edit_turn_;  ///< Held by the thread that edits, or undoes an edit.
  EditUndo undo_;         ///< Guarded as the map.
  ros::Time stamp_;       ///< Stamp of the last cloud in the map; 0 when there is none.
  std::string progress_;
  std::mutex changes_mutex_;
  bool is_everything_changed_ = false;
  std::uint64_t changed_revision_ = 0;
  cuboid_mapping::BrickTable<cuboid_mapping::ChangedBrick> changed_;
};

}  // namespace cuboid_mapping_ros
