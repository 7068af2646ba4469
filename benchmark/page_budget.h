// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/window/map_window.h"

#include <cmath>
#include <cstdint>
#include <unordered_map>

namespace cuboid_mapping::bench {

/// How many pages the geometry of a drive asks a window to read and to write, told by nothing but what the clouds touch and where
/// the window is: a page comes when a cloud touches it or the window reaches it, and goes when it lies beyond the margin and no
/// cloud has touched it for MapWindow::kIdleSteps clouds. A page that comes back is read, one that goes and was touched is written.
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
    const CellBox window = cubeAround(center_map, config_.size_m);
    const CellBox outer = cubeAround(center_map, config_.size_m + 2.0 * config_.margin_m);
    for (auto& [cell, page] : pages_) {
      if (!page.is_in && window.intersects(pageBox(cell))) {
        bringBack(page);
        page.last_use = step_;
      }
      const bool is_idle = page.last_use + MapWindow::kIdleSteps <= step_;
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

  [[nodiscard]] CellBox cubeAround(const Eigen::Vector3d& center_map, double edge_m) const {
    const Eigen::Array3d center = grid_.toCellUnits(center_map).array();
    const double half = 0.5 * edge_m / grid_.resolution();
    const auto to_cell = [](const Eigen::Array3d& at) {
      return Cell{static_cast<std::int32_t>(at.x()), static_cast<std::int32_t>(at.y()),
                  static_cast<std::int32_t>(at.z())};
    };
    return {to_cell((center - half).floor()), to_cell((center + half).ceil())};
  }

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
