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
  kKeep,    ///< It is stored on disk, and loaded before it changes.
  kForget,  ///< It becomes unknown.
  kRefuse   ///< It becomes unknown, and observations outside are refused.
};

/// Name of a state: "keep", "forget", "refuse".
[[nodiscard]] const char* toString(OutsideWindow outside);

/// Part of a map that stays in memory.
struct WindowConfig {
  double size_m = 100.0;   ///< Edge of the window, a cube: > 0.
  double margin_m = 10.0;  ///< Pages in memory stay up to this far outside the window: >= 0.
  OutsideWindow outside = OutsideWindow::kKeep;  ///< State of the map outside.
};

/// Cells whose pages stay in memory: the window around a point, and its margin. @param center_map  Metres.
[[nodiscard]] CellBox cellsKeptAround(const Eigen::Vector3d& center_map, const WindowConfig& config,
                                      const Grid& grid);

/// Counts of a window so far, and its state.
struct WindowFigures {
  std::size_t num_in_memory = 0;     ///< Pages in memory now.
  std::size_t num_on_disk_only = 0;  ///< Pages of the store that are not in memory now.
  std::uint64_t num_loads = 0;       ///< Pages that were loaded from the store.
  std::uint64_t num_writes = 0;      ///< Pages that were written to the store.
  std::uint64_t num_forgotten = 0;   ///< Pages that became unknown.
  std::uint64_t num_refused = 0;     ///< Observed bricks refused because they lie outside.
  std::uint64_t num_unreadable = 0;  ///< Observed bricks refused because their page cannot be read.
  std::uint64_t num_failures = 0;    ///< Failed calls of the store.
  std::string last_failure;          ///< Reason and cure of the last failure; empty without one.
};

/// Keeps those pages (page.h) of a map in memory that share a voxel with the window, a box around a point, or
/// that the last clouds have touched. Evicts the others.
///
/// With OutsideWindow::kKeep the map in memory and the store are one map, equal voxel by voxel to a
/// map without a window. The caller loads the pages that a change touches before it makes the change:
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
/// A page that cannot be written stays in memory, and is written again later: nothing is lost, and memory grows
/// meanwhile. A page that cannot be read stays in the store, and takes no observations.
///
/// Locks of the map stay when pages are evicted. A page with a locked voxel does not become unknown.
///
/// Const functions may run side by side, as those of the map; all others need exclusive access to both.
class MapWindow {
 public:
  /// @param store  A store with a head for OutsideWindow::kKeep; else null. @param map  Wholly in memory; all
  ///               of it counts as changed. All calls need the same map.
  /// @throws std::invalid_argument  for a bad size or margin, or a missing or needless store.
  MapWindow(const WindowConfig& config, std::unique_ptr<MapStore> store, const CuboidMap& map);

  /// Begins a step: moves the window, and loads the pages that an update touches. Pages that cannot be read are
  /// counted in the figures.
  /// @param center_map  Middle of the window. @param changes  Gets the loaded pages.
  /// @return The update to apply: `update`, or its admitted part, valid until the next step.
  /// @complexity O(bricks of the update); O(pages in the store) when the window moves to other pages.
  [[nodiscard]] const ScanUpdate& admit(const ScanUpdate& update, const Eigen::Vector3d& center_map,
                                        CuboidMap& map, ChangeSet& changes);

  /// Ends a step: notes the applied changes, prefetches pages of the window, and evicts others. Failures of the
  /// store are counted in the figures.
  ///
  /// Every kStepsAWrite-th step evicts pages to the store: at most kPagesAStep, or one in kPartLeaving of those
  /// that may leave if that is more, so that memory does not grow with the length of a drive.
  ///
  /// @param applied  The result of CuboidMap::apply() or commit().
  /// @param changes  Gets `applied`, and the loaded and evicted pages.
  /// @complexity O(pages in memory) besides the loaded and evicted pages.
  void settle(const ChangeSet& applied, CuboidMap& map, ChangeSet& changes);

  /// Number of pages in the store alone that share a cell with a box.
  /// @complexity O(pages of the box, or of the store if these are fewer).
  [[nodiscard]] std::size_t countNotLoaded(const CellBox& box) const;

  /// Loads the pages that share a cell with a box; they stay for kIdleSteps steps at least.
  /// @param changes  Gets the loaded pages, also when a page cannot be read. @param max_pages  Maximum number.
  /// @throws MapFileError  when a page cannot be read; the pages before it are loaded.
  void load(const CellBox& box, CuboidMap& map, ChangeSet& changes,
            std::size_t max_pages = std::numeric_limits<std::size_t>::max());

  /// Notes a change that was made outside of a step. @pre It was within pages that were
  /// in memory, or new.
  void note(const ChangeSet& changes);

  /// Notes that the whole map was replaced, and replaces the store. Errors are counted in the figures.
  void noteReplaced(const CuboidMap& map);

  /// Writes all changes to the store, if there is one.
  /// @return Whether this succeeded; else the figures say why, and all stays in memory.
  bool save(const CuboidMap& map);

  /// As save(), but at most kPagesAStep pages. @return Whether more remain, and this call succeeded.
  bool saveSome(const CuboidMap& map);

  /// Keeps all pages in memory until it is called with false, for long reads.
  void hold(bool is_held) { is_held_ = is_held; }

  /// Pages in the store alone, in no particular order.
  [[nodiscard]] std::vector<Cell> storedPages() const { return {stored_.begin(), stored_.end()}; }
  /// Appends the stored bricks of a page to a snapshot. Threads may call it side by side.
  /// @throws MapFileError  as readStore().
  void addStored(const Cell& page, const SnapshotLimits& limits, MapSnapshot& snapshot) const;

  /// Writes the sensor model of the map to the store. Errors are counted in the figures.
  void saveHead(const CuboidMap& map);

  /// See WindowFigures.
  [[nodiscard]] WindowFigures figures() const;
  /// The cells of the window; empty before the first step.
  [[nodiscard]] const CellBox& window() const { return window_; }
  /// Configuration of the constructor.
  [[nodiscard]] const WindowConfig& config() const { return config_; }

  /// Number of pages that a step evicts or prefetches; evictions keep up with the drive, see settle().
  static constexpr std::size_t kPagesAStep = 16;
  /// One in so many pages that may leave is evicted at once, where that is more than kPagesAStep.
  static constexpr std::size_t kPartLeaving = 4;
  /// Steps from one eviction to the store to the next: fewer transactions, which wait for the disk.
  static constexpr std::uint64_t kStepsAWrite = 8;
  /// Steps for which a touched page outside the window stays, so that pages within reach of the sensor are not
  /// evicted and loaded again and again.
  static constexpr std::uint64_t kIdleSteps = 10;
  /// Idle steps of a window: with kRefuse, pages are evicted at once.
  [[nodiscard]] static constexpr std::uint64_t idleSteps(const WindowConfig& config) {
    return config.outside == OutsideWindow::kRefuse ? 0 : kIdleSteps;
  }

 private:
  struct PageState {
    bool is_changed = false;  ///< Whether the page has changed since it was read or written.
    std::uint64_t last_use = 0;
  };
  using Pages = std::unordered_map<Cell, PageState, CellHash>;
  using PageSet = std::unordered_set<Cell, CellHash>;

  void moveTo(const Eigen::Vector3d& center_map, const Grid& grid);
  [[nodiscard]] PageSet bringBack(const std::vector<Cell>& touched, CuboidMap& map,
                                  ChangeSet& changes);
  void bringAhead(CuboidMap& map, ChangeSet& changes);
  /// Calls `visit(page)` for the pages in the store alone that share a cell with a box. @complexity As
  /// countNotLoaded().
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
  Pages pages_;              ///< Pages in memory.
  PageSet stored_;           ///< Pages only in the store.
  PageSet unreadable_;       ///< Pages among these that could not be read.
  std::vector<Cell> ahead_;  ///< Pages of the window to prefetch.
  CellBox window_;
  CellBox outer_;         ///< Cells of the window with its margin.
  CellBox window_pages_;  ///< Pages of its least and its last cell.
  ScanUpdate admitted_;   ///< The admitted part of an update.
  std::uint64_t step_ = 0;
  std::uint64_t next_write_ = 0;  ///< Step before which nothing is written, after a failure.
  bool is_store_stale_ = false;   ///< The store has a map that was replaced.
  bool is_held_ = false;
  std::size_t num_loaded_now_ = 0;  ///< Pages loaded in this step.
  WindowFigures figures_;
};

}  // namespace cuboid_mapping
