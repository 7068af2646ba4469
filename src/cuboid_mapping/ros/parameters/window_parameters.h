// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/window/map_window.h"

#include <cstddef>
#include <memory>
#include <string>

namespace cuboid_mapping_ros {

struct NodeParameters;

/// Part of the map that stays in memory.
struct WindowParameters {
  std::string frame_id;  ///< Frame that the window moves with; empty: no window.
  cuboid_mapping::WindowConfig config;
  std::string file;  ///< File of the store.

  [[nodiscard]] bool isOn() const { return !frame_id.empty(); }
  /// Whether there is a store.
  [[nodiscard]] bool keeps() const {
    return isOn() && config.outside == cuboid_mapping::OutsideWindow::kKeep;
  }
};

/// Text such as "3 parts of the map, of 64 x 64 x 64 voxels", for pages.
[[nodiscard]] std::string describePages(std::size_t num_pages);

/// The window of the parameters, with its store opened or created; null without a window.
/// @throws cuboid_mapping::MapFileError  as openStoreOf(), and std::runtime_error for conflicting parameters.
[[nodiscard]] std::unique_ptr<cuboid_mapping::MapWindow> makeWindow(
    const NodeParameters& parameters, const cuboid_mapping::CuboidMap& map);

}  // namespace cuboid_mapping_ros
