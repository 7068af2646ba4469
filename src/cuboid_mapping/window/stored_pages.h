// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/window/map_window.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

namespace cuboid_mapping {

/// The store of a window, and the pages that are in it alone; without a store, there are none.
///
/// Times are steps of the window. Functions throw MapFileError where the store cannot be read.
///
/// Thread rule: as MapWindow. fetch(), write() and writeHead() may run beside const functions.
class StoredPages {
 public:
  /// @param store  Null: none.
  explicit StoredPages(std::unique_ptr<MapStore> store);

  /// Whether there is a store.
  [[nodiscard]] bool hasStore() const { return store_ != nullptr; }
  /// Number of pages.
  [[nodiscard]] std::size_t size() const { return pages_.size(); }
  /// Whether a page is in the store alone.
  [[nodiscard]] bool contains(const Cell& page) const { return pages_.count(page) > 0; }
  /// Pages, at most `max_pages`, that share a cell with a box, in no particular order.
  /// @complexity As MapWindow::countNotLoaded().
  [[nodiscard]] std::vector<Cell> pagesIn(const CellBox& box, std::size_t max_pages) const;
  /// All pages, in no particular order.
  [[nodiscard]] std::vector<Cell> all() const { return {pages_.begin(), pages_.end()}; }

  /// Bricks of a page.
  [[nodiscard]] std::vector<VoxelBrick> read(const Cell& page) const;
  /// As read(), but moves bricks that fetch() has read.
  [[nodiscard]] std::vector<VoxelBrick> take(const Cell& page);
  /// Reads pages for take(), in place of those fetched before, up to the first that cannot be read.
  void fetch(const std::vector<Cell>& pages, std::uint64_t step);
  void forgetFetched() { fetched_.clear(); }

  /// Notes that a page is in the store alone, or also in memory.
  ///@{
  void insert(const Cell& page) { pages_.insert(page); }
  void erase(const Cell& page) {
    pages_.erase(page);
    unreadable_.erase(page);
  }
  ///@}
  /// Notes that the map was replaced: no page of the store counts any more, and the next write() replaces it.
  void markReplaced();

  /// Notes that a page could not be read.
  void noteUnreadable(const Cell& page, std::uint64_t step, const MapFileError& error);
  /// Whether a page could not be read a short while ago.
  [[nodiscard]] bool isUnreadable(const Cell& page, std::uint64_t step) const;
  /// Whether the time has come to read some page again that could not be read.
  [[nodiscard]] bool isRetryDue(std::uint64_t step) const;

  /// Writes pages of a map. @return Whether the store has them now; false without a try for a while after a failure.
  [[nodiscard]] bool write(const std::vector<Cell>& pages, const CuboidMap& map,
                           std::uint64_t step);
  /// Lets the next write() try, also after a failure.
  void retryNow() { next_write_ = 0; }
  /// Writes the sensor model of a map. Errors are counted.
  void writeHead(const CuboidMap& map);

  /// Counts a failure.
  void noteFailure(const char* text) noexcept;
  /// Adds the counts of pages, writes and failures.
  void addTo(WindowFigures& figures) const;

  /// Name of the store's file. @pre hasStore().
  [[nodiscard]] const std::string& file() const { return store_->file(); }

 private:
  std::unique_ptr<MapStore> store_;
  mutable std::mutex store_mutex_;  ///< Guards calls of the store.
  std::unordered_set<Cell, CellHash> pages_;
  /// Bricks of some of them.
  std::unordered_map<Cell, std::vector<VoxelBrick>, CellHash> fetched_;
  /// Those that could not be read, and the step of the last try.
  std::unordered_map<Cell, std::uint64_t, CellHash> unreadable_;
  std::uint64_t next_write_ = 0;  ///< Step before which nothing is written, after a failure.
  bool is_replaced_ = false;      ///< The store still has a map that was replaced.

  mutable std::mutex figures_mutex_;
  /// Guarded by figures_mutex_.
  ///@{
  std::uint64_t num_writes_ = 0;
  std::uint64_t num_failures_ = 0;
  std::string last_failure_;
  ///@}
};

}  // namespace cuboid_mapping
