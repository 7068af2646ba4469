// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/grid.h"

#include <Eigen/Core>

#include <cstdint>

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

/// The cells of the window around a point. @param center_map  Metres.
[[nodiscard]] CellBox windowAround(const Eigen::Vector3d& center_map, const WindowConfig& config,
                                   const Grid& grid);
/// Cells whose pages stay in memory: the window around a point, and its margin. @param center_map  Metres.
[[nodiscard]] CellBox cellsKeptAround(const Eigen::Vector3d& center_map, const WindowConfig& config,
                                      const Grid& grid);

}  // namespace cuboid_mapping
