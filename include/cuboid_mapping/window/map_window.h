// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/function_ref.h"
#include "cuboid_mapping/io/map_store.h"
#include "cuboid_mapping/map/cuboid_map.h"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
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

  /// Steps for which a touched page outside the window stays, so that pages within reach of the sensor are not
  /// evicted and loaded again and again. With kRefuse, pages are evicted at once.
  ///@{
  static constexpr std::uint64_t kIdleSteps = 10;
  [[nodiscard]] std::uint64_t idleSteps() const {
    return outside == OutsideWindow::kRefuse ? 0 : kIdleSteps;
  }
  ///@}
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

class StoredPages;

/// Keeps those pages (page.h) of a map in memory that share a voxel with the window, a box around a point, or
/// that the last clouds have touched. Evicts the others.
///
/// With OutsideWindow::kKeep the map in memory and the store are one map, equal voxel by voxel to a
/// map without a window. Changes go through the window, which loads the pages that they touch:
///
///     MapWindow window(config, std::move(store), map);
///     const ScanUpdate& admitted = window.admit(update, center_map, changes);  // a cloud
///     CuboidMap::PendingChange change = map.prepare(admitted, model);
///     window.commit(change, changes);
///
///     window.edit(box, [&] { return map.replace(box, bricks); }, changes);  // an edit
///
/// Nobody else may change the voxels of the map; readers may look at it.
///
/// A page that cannot be written stays in memory, and is written again later: nothing is lost, and memory grows
/// meanwhile. A page that cannot be read stays in the store, and takes no observations until a later try succeeds.
///
/// Where memory fails, a function throws std::bad_alloc. Pages may have been loaded, and the change itself has not
/// been made (but for replaceAll()).
///
/// Locks of the map stay when pages are evicted. A page with a locked voxel does not become unknown.
///
/// `changes` gets the changed bricks, those of loaded and evicted pages too, also when a function throws.
///
/// fetch(), prepareCommit() and save() leave the disk's work to a time at which others read the map:
///
///     window.fetch(update);         // before admit()
///     window.prepareCommit();       // before commit()
///
/// Without them, admit(), commit(), load() and edit() read and write themselves.
///
/// Thread rule: const functions may run side by side, as those of the map. fetch(), prepareCommit(), save(), saveSome()
/// and saveHead() may run beside them, but not beside each other. All others need exclusive access to both.
class MapWindow {
 public:
  /// @param store  A store with a head for OutsideWindow::kKeep; else null. @param map  Wholly in memory; all
  ///               of it counts as changed. Must outlive this object, and not move.
  /// @throws std::invalid_argument  for a bad size or margin, or a missing or needless store.
  MapWindow(const WindowConfig& config, std::unique_ptr<MapStore> store, CuboidMap& map);
  MapWindow(const MapWindow&) = delete;
  MapWindow& operator=(const MapWindow&) = delete;
  ~MapWindow();

  /// No limit of a number of pages.
  static constexpr std::size_t kAllPages = std::numeric_limits<std::size_t>::max();

  /// Reads the pages that admit(), or load() or edit() of a box, will need, and cannot find in memory.
  ///@{
  void fetch(const ScanUpdate& update);
  void fetch(const CellBox& box, std::size_t max_pages = kAllPages);
  ///@}

  /// Begins a step: moves the window, and loads the pages that an update touches. Pages that cannot be read are
  /// counted in the figures.
  /// @param center_map  Middle of the window. @throws std::invalid_argument  It is not finite; nothing has changed.
  /// @return The update to apply: `update`, or its admitted part, valid until the next step.
  /// @complexity O(bricks of the update); O(pages in the store) when the window moves to other pages.
  [[nodiscard]] const ScanUpdate& admit(const ScanUpdate& update, const Eigen::Vector3d& center_map,
                                        ChangeSet& changes);

  /// Reads the pages that commit() will prefetch, and writes those that it will evict. Failures are counted in the
  /// figures.
  void prepareCommit();

  /// Ends a step: makes the change, see CuboidMap::commit(); prefetches pages of the window, and evicts others. Failures
  /// of the store, and of memory after the change, are counted in the figures.
  ///
  /// Every kStepsAWrite-th step evicts pages to the store: at most kPagesAStep, or one in kEvictedShare of those
  /// that may be evicted if that is more, so that memory does not grow with the length of a drive.
  ///
  /// @param change  The result of CuboidMap::prepare() for that of admit().
  /// @complexity O(pages in memory) besides the change and the loaded and evicted pages.
  void commit(CuboidMap::PendingChange& change, ChangeSet& changes);

  /// Changes voxels of a box, whose pages are loaded first.
  /// @param work  Changes the map within the box. Its exceptions are passed on; everything counts as changed then.
  /// @throws MapFileError  when a page cannot be read; `work` is not called then.
  void edit(const CellBox& box, FunctionRef<ChangeSet()> work, ChangeSet& changes);

  /// Replaces the whole map. The next write replaces the store.
  /// @param work  Replaces the map. Its exceptions are passed on: the pages are those of the map that it leaves.
  void replaceAll(FunctionRef<ChangeSet()> work, ChangeSet& changes);

  /// Number of pages in the store alone that share a cell with a box.
  /// @complexity O(pages of the box, or of the store if these are fewer).
  [[nodiscard]] std::size_t countNotLoaded(const CellBox& box) const;

  /// Loads the pages that share a cell with a box; they stay for WindowConfig::kIdleSteps steps at least.
  /// @param max_pages  Maximum number.
  /// @throws MapFileError  when a page cannot be read; the pages before it are loaded.
  void load(const CellBox& box, ChangeSet& changes, std::size_t max_pages = kAllPages);

  /// Whether work on the map has failed: its pages must be listed anew before save() or saveSome() can do without
  /// exclusive access.
  [[nodiscard]] bool arePagesStale() const { return are_pages_stale_; }
  /// Lists the pages of the map anew, if they are stale.
  void refresh();
  /// Writes all changes to the store, if there is one.
  /// @return Whether this succeeded; else the figures say why, and all stays in memory.
  bool save();

  /// As save(), but at most kPagesAStep pages. @return Whether more remain, and this call succeeded.
  bool saveSome();

  /// Keeps all pages in memory until it is called with false, for long reads.
  void hold(bool is_held) { is_held_ = is_held; }

  /// Pages in the store alone, in no particular order.
  [[nodiscard]] std::vector<Cell> storedPages() const;
  /// Appends the stored bricks of a page to a snapshot. Threads may call it side by side.
  /// @throws MapFileError  as readStore().
  void addStored(const Cell& page, const SnapshotLimits& limits, MapSnapshot& snapshot) const;

  /// Writes the sensor model of the map to the store. Errors are counted in the figures.
  void saveHead();

  /// See WindowFigures.
  [[nodiscard]] WindowFigures figures() const;
  /// The cells of the window; empty before the first step.
  [[nodiscard]] const CellBox& window() const { return window_; }
  /// Configuration of the constructor.
  [[nodiscard]] const WindowConfig& config() const { return config_; }

  /// Number of pages that a step evicts or prefetches; evictions keep up with the drive, see commit().
  static constexpr std::size_t kPagesAStep = 16;
  /// One in so many pages that may be evicted is evicted at once, where that is more than kPagesAStep.
  static constexpr std::size_t kEvictedShare = 4;
  /// Steps from one eviction to the store to the next: fewer transactions, which wait for the disk.
  static constexpr std::uint64_t kStepsAWrite = 8;

 private:
  struct PageState {
    bool is_dirty = false;  ///< Whether the page has changed since it was read or written.
    std::uint64_t last_use = 0;
  };
  using Pages = std::unordered_map<Cell, PageState, CellHash>;
  using PageSet = std::unordered_set<Cell, CellHash>;

  void moveTo(const Eigen::Vector3d& center_map);
  [[nodiscard]] PageSet loadTouched(const std::vector<Cell>& touched, ChangeSet& changes);
  void prefetch(ChangeSet& changes);
  void loadPage(const Cell& page, ChangeSet& changes);
  [[nodiscard]] bool isTurnToEvict() const;
  [[nodiscard]] std::vector<Cell> dirtyOf(const std::vector<Cell>& pages) const;
  [[nodiscard]] std::vector<Cell> findEvictable() const;
  void evict(std::vector<Cell> pages, ChangeSet& changes);
  void markDirty(const ChangeSet& changes) noexcept;
  void listPages();
  [[nodiscard]] std::vector<Cell> findDirty() const;
  [[nodiscard]] bool write(const std::vector<Cell>& pages);

  WindowConfig config_;
  CuboidMap& map_;
  std::unique_ptr<StoredPages> stored_;  ///< Pages in the store alone.
  Pages pages_;                          ///< Pages in memory.
  std::vector<Cell> ahead_;              ///< Pages of the window to prefetch.
  CellBox window_;
  CellBox outer_;         ///< Cells of the window with its margin.
  CellBox window_pages_;  ///< Pages of its corners.
  ScanUpdate admitted_;   ///< The admitted part of an update.
  std::uint64_t step_ = 0;
  /// Pages of the map may lack in `pages_`, after a failure of memory.
  bool are_pages_stale_ = false;
  bool is_held_ = false;
  std::size_t num_loaded_now_ = 0;  ///< Pages loaded in this step.
  WindowFigures figures_;           ///< Without those of stored_.
};

}  // namespace cuboid_mapping
