// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/map_snapshot.h"

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping {

/// Options of map_convert for boxes.
struct BoxOptions {
  bool are_joined = false;             ///< .csv: cuboids joined across bricks.
  std::size_t max_boxes = 0;           ///< Maximum number of boxes to cover the voxels; 0: none.
  std::vector<std::string> keep_free;  ///< Each "min_x min_y min_z max_x max_y max_z", metres.
  std::vector<double> keep_passages_m{0.5};  ///< One number for all edges of a robot, or three.
};

/// Whether a file gets boxes, and not a map. @throws std::runtime_error for options that do not fit its
/// format.
[[nodiscard]] bool isBoxOutput(const std::string& file, const BoxOptions& options);

/// Replaces a file by the boxes of a map.
/// @param part  Part of the map. @return A summary: "200 boxes, 80.3 m3 occupied, 147 m3 added".
/// @throws std::runtime_error saying what to change; MapFileError.
[[nodiscard]] std::string writeBoxes(const std::string& file, const MapSnapshot& snapshot,
                                     const std::optional<CellBox>& part, const BoxOptions& options);

}  // namespace cuboid_mapping
