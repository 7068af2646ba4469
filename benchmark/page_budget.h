// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/window/map_window.h"

#include <cstdint>
#include <unordered_map>

namespace cuboid_mapping::bench {

/// How many pages the geometry of a drive asks a window to read and to write, told by nothing but what the clouds touch and where
/// the window is: a page comes when a cloud touches it or the window reaches it, and goes when it lies beyond the margin and no
/// cloud has touched it for WindowConfig::kIdleSteps clouds. A page that comes back is read, one that goes and was touched is written.
/// A MapWindow that lets pages go later, some at a time, needs no more.
class PageBudget {
 public:
  PageBudget(const WindowConfig& config, const Grid& grid) : config_(config), grid_(grid) {}

  /// To be told of each cloud, in order.
  void note(const ScanUpdate& update, const Eigen::Vector3d& center_map) {
    ++step_;
    for (const BrickUpdate& brick : update.bricks) {
      Page& page = pages_[pageOf(brick.brick)];
      bringBack(page);
      page.is_touched = true;
      page.last_use = step_;
    }
    WindowConfig without_margin = config_;
    without_margin.margin_m = 0.0;
    const CellBox window = cellsKeptAround(center_map, without_margin, grid_);
    const CellBox outer = cellsKeptAround(center_map, config_, grid_);
    for (auto& [cell, page] : pages_) {
      if (!page.is_in && window.intersects(pageBox(cell))) {
        bringBack(page);
        page.last_use = step_;
      }
      const bool is_idle = page.last_use + WindowConfig::kIdleSteps <= step_;
      if (page.is_in && is_idle && !outer.intersects(pageBox(cell))) letGo(page);
    }
  }

  [[nodiscard]] std::uint64_t numReads() const { return num_reads_; }
  [[nodiscard]] std::uint64_t numWrites() const { return num_writes_; }

 private:
  struct Page {
    bool is_new = true;
    bool is_in = false;
    bool is_touched = false;  ///< Since it came.
    std::uint64_t last_use = 0;
  };

  void bringBack(Page& page) {
    if (!page.is_in && !page.is_new) ++num_reads_;
    page.is_in = true;
    page.is_new = false;
  }

  void letGo(Page& page) {
    num_writes_ += page.is_touched ? 1 : 0;
    page.is_in = false;
    page.is_touched = false;
  }

  WindowConfig config_;
  Grid grid_;
  std::unordered_map<Cell, Page, CellHash> pages_;
  std::uint64_t step_ = 0;
  std::uint64_t num_reads_ = 0;
  std::uint64_t num_writes_ = 0;
};

}  // namespace cuboid_mapping::bench
