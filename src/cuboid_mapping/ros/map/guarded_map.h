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
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

namespace cuboid_mapping_ros {

/// Keeps all parts of a map in memory while it lives.
class PageHold {
 public:
  explicit PageHold(std::atomic<int>& count) : count_(count) { ++count_; }
  ~PageHold() { --count_; }
  PageHold(const PageHold&) = delete;
  PageHold& operator=(const PageHold&) = delete;

 private:
  std::atomic<int>& count_;
};

/// Gives a map that was built beside the current one the current sensor model, which may have changed
/// meanwhile.
void followSensorModel(const CuboidMap& map, CuboidMap& fresh);

/// A map that one thread fills while others read it. Thread-safe.
///
/// A writer has exclusive access for milliseconds, to commit a cloud. Readers share it, and see the last committed
/// change. They continue while the change of a cloud is computed, and while pages of a window are read or written.
/// Many small changes or many readers starve nobody, and a long reader blocks no other reader:
/// see PhaseFairMutex.
class GuardedMap {
 public:
  explicit GuardedMap(const MapConfig& config) : map_(config) {}

  [[nodiscard]] const Grid& grid() const { return map_.grid(); }

  /// Number of this run, for others: the time of its start [ns].
  [[nodiscard]] std::uint64_t instance() const { return instance_; }

  /// Keeps only a window of the map in memory from now on. Call it before others use the map.
  /// @param make  (CuboidMap&) -> std::unique_ptr<MapWindow>; null for none.
  template <typename MakeT>
  void setWindow(const MakeT& make) {
    window_ = make(map_);
  }

  /// Keeps the history of the map from now on; it must have the whole map. Call it before others use the map.
  void setHistory(std::unique_ptr<KeptHistory> history) { history_ = std::move(history); }
  /// The history; null without one.
  [[nodiscard]] KeptHistory* history() const { return history_.get(); }

  /// Puts the voxels of a cloud into the map. Depending on the window, pages outside it are loaded first, or
  /// their voxels are left out. Otherwise as change(); readers continue while the new voxels are computed.
  /// @param model  Sensor model, see CuboidMap::apply(). @param window_center_map  Ignored without a window.
  /// @param kept  Cloud for the history, if there is one.
  void integrate(const ros::Time& stamp, const ScanUpdate& update, const SensorModel& model,
                 const Eigen::Vector3d& window_center_map,
                 const std::optional<KeptObservation>& kept = std::nullopt);

  /// Replaces the map by a corrected one, and the poses of the history. Otherwise as replaceAll().
  /// @pre There is a history. @throws As MapHistory::finish(), and KeptHistory::whole(): all is then as it was.
  void exchange(MapCorrection& correction);

  /// Changes voxels of a box, whose pages are loaded first. Otherwise as edit().
  /// @param whole  Box of the whole edit if this is a part of it, for the history; else empty.
  /// @throws MapFileError  if a page cannot be loaded: no voxel has changed, and the pages before it are
  ///         loaded.
  template <typename WorkT>
  void editIn(const CellBox& box, const WorkT& work, const CellBox& whole = {}) {
    const Changing changing(change_);
    if (window_) window_->fetch(box);
    const WriteLock alone(mutex_);
    const auto edit = [&] { return call(work, map_, std::as_const(stamp_)); };
    if (window_) {
      noteGathered([&](ChangeSet& changes) { window_->edit(box, edit, changes); });
    } else {
      noteChangesOf(edit);
    }
    noteEdit(box, whole);
  }

  /// Replaces the whole map, in memory and on disk, unless the work throws. Otherwise as edit(); the work may set the stamp.
  /// @param work  (CuboidMap&) or (CuboidMap&, ros::Time& stamp) -> ChangeSet.
  template <typename WorkT>
  void replaceAll(const WorkT& work) {
    const Changing changing(change_);
    replaceWhole([&] { return call(work, map_, stamp_); });
    if (history_) history_->restart(map_);
  }

  /// Changes the map. Exceptions of the work are passed on: the map then stays as the work has left it, with
  /// the stamp as before, and takeChanges() reports that everything has changed.
  /// @param work  (CuboidMap&) -> ChangeSet. @param stamp  Stamp of the map after it.
  template <typename WorkT>
  void change(const ros::Time& stamp, const WorkT& work) {
    const ChangeLock lock(*this);
    noteChangesOf([&] { return work(map_); });
    stamp_ = stamp;
  }

  /// Changes the map without a cloud: its stamp stays. Of such a change the history keeps the locks only. Otherwise as
  /// change().
  /// @param work  (CuboidMap&) or (CuboidMap&, const ros::Time& stamp) -> ChangeSet.
  template <typename WorkT>
  void edit(const WorkT& work) {
    const ChangeLock lock(*this);
    noteChangesOf([&] { return call(work, map_, std::as_const(stamp_)); });
    noteEdit({}, {});
  }

  /// Begins an edit that undoEdit() undoes: calls of edit() and editIn() with keepForUndo(), while the result
  /// lives. Edits wait for each other, so that the last one is undone exactly.
  [[nodiscard]] std::unique_lock<std::mutex> beginEdit();
  /// Keeps the voxels of a box, and the locks, before they change. @pre Called by the work of an edit that has
  /// begun.
  void keepForUndo(const CellBox& box) { undo_.keep(map_, box); }
  /// Restores the voxels and locks that the last edit replaced, even if clouds have changed them since; see
  /// EditUndo.
  /// @return Number of edits that can still be undone; nothing if there was none.
  /// @throws std::bad_alloc, MapFileError  The next call undoes the rest of the edit.
  std::optional<std::size_t> undoEdit();

  /// Reads the map. @param work  (const CuboidMap&) or (const CuboidMap&, const ros::Time& stamp) -> any.
  template <typename WorkT>
  auto read(const WorkT& work) const {
    const ReadLock lock(mutex_);
    return call(work, map_, stamp_);
  }

  /// As read(), for work that takes long: its turn is after that of a waiting writer, so that nobody waits for both.
  /// @pre Not called by the work of another reader.
  template <typename WorkT>
  auto readWhole(const WorkT& work) const {
    const ReadLock lock(mutex_, true);
    return call(work, map_, stamp_);
  }

  /// Stamp of the last cloud in the map; 0 when there is none.
  [[nodiscard]] ros::Time stamp() const {
    const ReadLock lock(mutex_);
    return stamp_;
  }
  [[nodiscard]] MapConfig config() const {
    const ReadLock lock(mutex_);
    return map_.config();
  }

  /// As readWhole(), with the window: null if the whole map is in memory.
  /// @param work  (const CuboidMap&, const ros::Time& stamp, const MapWindow*) -> any.
  template <typename WorkT>
  auto readWithWindow(const WorkT& work) const {
    return readWhole([&](const CuboidMap& map, const ros::Time& stamp) {
      return work(map, stamp, static_cast<const MapWindow*>(window_.get()));
    });
  }

  /// Reads the map for long: others get their turn where the work allows it (Budget::spendAndUnlock()), and the
  /// map may have changed afterwards.
  /// @param work  (const CuboidMap&, const ros::Time& stamp, Budget&) -> any; the stamp is read at
  ///              the beginning.
  /// @param is_stopped  true ends the budget; may be null.
  template <typename WorkT>
  auto readInTurns(const QueryLimits& limits, const std::atomic<bool>* is_stopped,
                   const WorkT& work) const {
    ReadLock lock(mutex_);
    const auto yield = [&lock] { lock.yield(); };
    Budget budget(limits, {yield, kTurn_s, is_stopped});
    return work(std::as_const(map_), ros::Time(stamp_), budget);
  }

  /// State of the program that makes the map, kept with it: MapSnapshot::progress.
  using Progress = std::function<std::string()>;
  /// @param progress  Called where the map is saved. @pre Nobody else uses the map, or in the work of change() or edit().
  void setProgress(Progress progress) { progress_ = std::move(progress); }
  /// @pre Called by the work of read().
  [[nodiscard]] std::string progress() const { return progress_ ? progress_() : ""; }

  /// Number of calls of replaceAll() and exchange(). @pre Called by the work of read().
  [[nodiscard]] std::uint64_t numReplaced() const { return num_replaced_; }

  /// Keeps pages in memory, also those that are read, while the result lives.
  [[nodiscard]] PageHold hold() { return PageHold(num_holds_); }
  /// Number of pages of a box that are on disk only; 0 without a window. @complexity O(pages of the box).
  [[nodiscard]] std::size_t countNotLoaded(const CellBox& box) const;
  /// Default region of a search: the window if parts of the map are on disk only, else everything.
  [[nodiscard]] std::optional<CellBox> regionOfSearch() const;
  /// Loads the pages of a box, some at a time, so that others get their turn.
  /// @param is_stopped  true ends it; may be null.
  /// @throws MapFileError  if a page cannot be loaded: the pages before it are.
  void load(const CellBox& box, const std::atomic<bool>* is_stopped = nullptr);
  /// Figures of the window; nothing without one.
  [[nodiscard]] std::optional<WindowFigures> windowFigures() const;
  /// Writes changes to the disk, some pages at a time, so that others get their turn.
  /// @return Error, which, if the disk failed, the figures of the window count, too; empty: all is saved, or there is no
  /// window.
  [[nodiscard]] std::string save();
  /// Writes the sensor model of the map to the store.
  void saveHead();

  /// Bricks changed since the last call, each once.
  [[nodiscard]] ChangeSet takeChanges();

  /// As above, while nobody changes the map.
  /// @param work  (const CuboidMap&, const ros::Time& stamp, const ChangeSet&). Its exceptions are passed on,
  ///              and the next call reports that everything has changed.
  template <typename WorkT>
  ChangeSet takeChanges(const WorkT& work) {
    return readWhole([&](const CuboidMap& map, const ros::Time& stamp) {
      ChangeSet changes = takeChanges();
      try {
        work(map, stamp, changes);
      } catch (...) {
        noteEverything();
        throw;
      }
      return changes;
    });
  }

 private:
  /// Time after which a long reader lets others have their turn, where its work allows it: a fifth of the time between
  /// two clouds at 10 Hz.
  static constexpr double kTurn_s = 0.02;

  using Changing = std::lock_guard<FairMutex>;
  using WriteLock = std::lock_guard<PhaseFairMutex>;

  /// Calls work with the map, and with the stamp if it takes one.
  template <typename WorkT, typename MapT, typename StampT>
  static auto call(const WorkT& work, MapT& map, StampT& stamp) {
    if constexpr (std::is_invocable_v<const WorkT&, MapT&>) {
      return work(map);
    } else {
      return work(map, stamp);
    }
  }

  /// Shared access for readers.
  class ReadLock {
   public:
    explicit ReadLock(PhaseFairMutex& mutex, bool is_long = false)
        : mutex_(mutex), generation_(mutex.lockShared(is_long)) {}
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

  /// Exclusive access.
  class ChangeLock {
   public:
    explicit ChangeLock(const GuardedMap& map) : changing_(map.change_), alone_(map.mutex_) {}

   private:
    Changing changing_;
    WriteLock alone_;
  };

  /// @param work  (ChangeSet& changes): adds the changes so far, also when it throws.
  template <typename WorkT>
  void noteGathered(const WorkT& work) {
    ChangeSet changes{map_.revision(), false, {}};
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
  /// @param work  () -> ChangeSet. @pre This thread holds change_.
  template <typename WorkT>
  void replaceWhole(const WorkT& work) {
    const auto replace = [&] {
      ChangeSet changes = work();
      ++num_replaced_;
      undo_.clear();
      return changes;
    };
    {
      const WriteLock alone(mutex_);
      if (!window_) return noteChangesOf(replace);
      noteGathered([&](ChangeSet& changes) { window_->replaceAll(replace, changes); });
    }
    (void)window_->save();
  }
  void note(const ChangeSet& changes);
  /// Makes takeChanges() report that everything has changed.
  void noteEverything() noexcept;
  void noteEdit(const CellBox& box, const CellBox& whole) {
    if (!history_) return;
    history_->change([&](MapHistory& history) { history.addEdit(box, map_, whole); });
  }
  [[nodiscard]] const ScanUpdate& admit(const ScanUpdate& update,
                                        const Eigen::Vector3d& window_center_map);

  const std::uint64_t instance_ = ros::WallTime::now().toNSec();
  mutable FairMutex change_;      ///< Held by the thread that changes the map or prepares a change.
  mutable PhaseFairMutex mutex_;  ///< Written by the holder of `change_`.
  CuboidMap map_;
  std::unique_ptr<MapWindow> window_;     ///< May be null.
  std::unique_ptr<KeptHistory> history_;  ///< May be null.
  std::atomic<int> num_holds_{0};
  std::uint64_t num_replaced_ = 0;
  std::mutex edit_turn_;  ///< Held by the thread that edits, or undoes an edit.
  EditUndo undo_;         ///< Guarded like the map.
  ros::Time stamp_;       ///< Stamp of the last cloud in the map; 0 when there is none.
  Progress progress_;
  std::mutex changes_mutex_;
  bool is_everything_changed_ = false;
  std::uint64_t changed_revision_ = 0;
  BrickTable<ChangedBrick> changed_;
};

}  // namespace cuboid_mapping_ros
