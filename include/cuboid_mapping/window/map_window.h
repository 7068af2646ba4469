// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/io/map_store.h"
#include "cuboid_mapping/map/cuboid_map.h"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

namespace cuboid_mapping {

/// State of the map outside a window.
enum class OutsideWindow : unsigned char {
  kKeep,    ///< It goes to a store on disk, and comes back before it changes.
  kForget,  ///< It becomes unknown.
  kRefuse   ///< It becomes unknown, and observations outside are not taken.
};

/// "keep", "forget", "refuse".
[[nodiscard]] const char* toString(OutsideWindow outside);

/// Which part of a map stays in memory.
struct WindowConfig {
  double size_m = 100.0;   ///< Edge of the window, a cube: > 0.
  double margin_m = 10.0;  ///< So far outside the window a page stays that is in memory: >= 0.
  OutsideWindow outside = OutsideWindow::kKeep;  ///< State of the map outside.
};

/// The cells around the middle of a window that stay in memory: the window and its margin.
[[nodiscard]] CellBox cellsKeptAround(const Eigen::Vector3d& center_map, const WindowConfig& config,
                                      const Grid& grid);

/// Counts of a window so far, and its state.
struct WindowFigures {
  std::size_t num_in_memory = 0;     ///< Pages in memory now.
  std::size_t num_on_disk_only = 0;  ///< Pages of the store that are not in memory now.
  std::uint64_t num_loads = 0;       ///< Pages that came back from the store.
  std::uint64_t num_writes = 0;      ///< Pages that were written to it.
  std::uint64_t num_forgotten = 0;   ///< Pages that became unknown.
  std::uint64_t num_refused =
      0;  ///< Bricks of observations that were not taken, for lying outside.
  std::uint64_t num_unreadable = 0;  ///< The same, for lying in a page that cannot be read.
  std::uint64_t num_failures = 0;    ///< Calls of the store that have failed.
  std::string last_failure;          ///< Reason and cure; empty: none has failed.
};

/// Keeps the pages (map_store.h) of a map in memory that share a voxel with a box around a place, the
/// window, and those that the last clouds have touched; the others leave.
///
/// With OutsideWindow::kKeep the map in memory and the store are one map: voxel by voxel what it would
/// be without a window. Before a change, whoever makes it has the pages brought back that it touches:
///
///     ChangeSet changes;
///     const ScanUpdate& admitted = window.admit(update, center_map, map, changes);  // a cloud
///     window.settle(map.apply(admitted), map, changes);
///
///     window.load(box, map, changes);  // an edit
///     const ChangeSet edited = map.replace(box, bricks);
///     window.note(edited);
///
/// Nobody else may change the map between these calls; readers may look at it.
///
/// When a page cannot be written, it stays in memory and is tried again: nothing is lost, and memory
/// grows meanwhile. When one cannot be read, the store keeps it, and no observation is taken there.
///
/// Locks of the map stay whatever leaves; a page with a locked voxel is not forgotten.
///
/// Const functions may run side by side, as those of the map; all others need exclusive access to both.
class MapWindow {
 public:
  /// @param store  With OutsideWindow::kKeep, and only then: with a head. @param map  In memory so far: all of it
  ///               counts as changed. The same map belongs to all calls.
  /// @throws std::invalid_argument  for a bad size or margin, or a store too many or too few.
  MapWindow(const WindowConfig& config, std::unique_ptr<MapStore> store, const CuboidMap& map);

  /// Begins a step: moves the window, and brings back the pages that an update touches. Pages that cannot be read are
  /// counted in the figures.
  /// @param center_map  Middle of the window. @param changes  Gets the pages that come.
  /// @return The update to apply: `update`, or its admitted part, valid until the next step.
  /// @complexity O(bricks of the update) besides the pages that come.
  [[nodiscard]] const ScanUpdate& admit(const ScanUpdate& update, const Eigen::Vector3d& center_map,
                                        CuboidMap& map, ChangeSet& changes);

  /// Ends a step: notes what was applied, brings back pages of the window ahead of need, and lets others leave. A store that
  /// fails is counted in the figures.
  ///
  /// Pages leave for the store in every kStepsAWrite-th step: kPagesAStep at most, or as many as were
  /// brought back since the last time, so that a step takes no time that grows with the window.
  ///
  /// @param applied  The result of CuboidMap::apply() or commit().
  /// @param changes  Gets `applied`, and the pages that come and leave.
  /// @complexity O(pages in memory) besides the pages that come and go.
  void settle(const ChangeSet& applied, CuboidMap& map, ChangeSet& changes);

  /// Pages in the store alone that share a cell with a box.
  /// @complexity O(pages of the box, or of the store if these are fewer).
  [[nodiscard]] std::size_t countNotLoaded(const CellBox& box) const;

  /// Brings back the pages that share a cell with a box; they stay for kIdleSteps steps at least.
  /// @param changes  Gets the pages that come, also when a page cannot be read. @param max_pages  Maximum number.
  /// @throws MapFileError  when one cannot be read: those before it are there.
  void load(const CellBox& box, CuboidMap& map, ChangeSet& changes,
            std::size_t max_pages = std::numeric_limits<std::size_t>::max());

  /// To be told of each change that was made outside of a step. @pre It was within pages that were
  /// in memory, or new.
  void note(const ChangeSet& changes);

  /// To be told that all of the map was replaced, which the store is, too. Fails as save().
  void noteReplaced(const CuboidMap& map);

  /// Writes all that has changed to the store; nothing without one.
  /// @return Whether it is there; else the figures say why, and all stays in memory.
  bool save(const CuboidMap& map);

  /// As save(), but kPagesAStep pages at most. @return Whether more are to be written, and this went well.
  bool saveSome(const CuboidMap& map);

  /// Keeps all pages in memory until it is told otherwise, for long reads.
  void hold(bool is_held) { is_held_ = is_held; }

  /// Pages in the store alone, in no particular order.
  [[nodiscard]] std::vector<Cell> storedPages() const { return {stored_.begin(), stored_.end()}; }
  /// Adds the bricks that the store has of a page to a snapshot. @throws MapFileError  as readStore().
  void addStored(const Cell& page, const SnapshotLimits& limits, MapSnapshot& snapshot) const;

  /// Takes the sensor model of the map into the store. Fails as save().
  void saveHead(const CuboidMap& map);

  /// See WindowFigures.
  [[nodiscard]] WindowFigures figures() const;
  /// The cells of the window; empty before the first step.
  [[nodiscard]] const CellBox& window() const { return window_; }
  /// As it was made.
  [[nodiscard]] const WindowConfig& config() const { return config_; }

  /// Pages that leave, or are brought back ahead of need, in a step.
  static constexpr std::size_t kPagesAStep = 16;
  /// Steps between two evictions: fewer transactions, which wait for the disk.
  static constexpr std::uint64_t kStepsAWrite = 8;
  /// Number of steps that a touched page outside stays, so that pages within reach do not come and go with
  /// each.
  static constexpr std::uint64_t kIdleSteps = 10;
  /// The same of a window: with kRefuse it goes at once.
  [[nodiscard]] static constexpr std::uint64_t idleSteps(const WindowConfig& config) {
    return config.outside == OutsideWindow::kRefuse ? 0 : kIdleSteps;
  }

 private:
  struct PageState {
    bool is_changed = false;  ///< Since it was read or written.
    std::uint64_t last_use = 0;
  };
  using Pages = std::unordered_map<Cell, PageState, CellHash>;
  using PageSet = std::unordered_set<Cell, CellHash>;

  void moveTo(const Eigen::Vector3d& center_map, const Grid& grid);
  [[nodiscard]] PageSet bringBack(const std::vector<Cell>& touched, CuboidMap& map,
                                  ChangeSet& changes);
  void bringAhead(CuboidMap& map, ChangeSet& changes);
  /// Calls `visit(page)` for the pages in the store alone that share a cell with a box. @complexity As countNotLoaded().
  template <typename VisitT>
  void forEachStored(const CellBox& box, const VisitT& visit) const;
  void loadPage(const Cell& page, CuboidMap& map, ChangeSet& changes);
  [[nodiscard]] std::vector<Cell> findLeaving(const CuboidMap& map) const;
  void letLeave(std::vector<Cell> pages, CuboidMap& map, ChangeSet& changes);
  [[nodiscard]] std::vector<Cell> findChanged() const;
  [[nodiscard]] bool write(const std::vector<Cell>& pages, const CuboidMap& map);
  void noteFailure(const std::string& text);

  WindowConfig config_;
  mutable std::mutex reading_;  ///< Guards concurrent reads of the store.
  std::unique_ptr<MapStore> store_;
  Pages pages_;              ///< In memory.
  PageSet stored_;           ///< Only in the store.
  PageSet unreadable_;       ///< Pages among these that could not be read.
  std::vector<Cell> ahead_;  ///< In the window, to be brought back.
  CellBox window_;
  CellBox outer_;         ///< With the margin.
  CellBox window_pages_;  ///< Pages of its least and its last cell.
  ScanUpdate admitted_;   ///< The admitted part of an update.
  std::uint64_t step_ = 0;
  std::uint64_t next_write_ = 0;  ///< Step before which nothing is written, after a failure.
  bool is_store_stale_ = false;   ///< It has a map that was replaced.
  bool is_held_ = false;
  std::size_t num_loaded_now_ = 0;  ///< In this step.
  std::size_t num_owed_ = 0;        ///< Came back since pages left.
  WindowFigures figures_;
};

}  // namespace cuboid_mapping
