// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/sharing/observation_order.h"

#include <string>

namespace cuboid_mapping_ros {

/// JSON for MapSnapshot::progress: {"newest_stamp_ns": ..., "sessions": [{"robot": "/robot1", "session": ...,
/// "left_out": 0, "applied": [[1, 24], [26, 40]]}]}.
[[nodiscard]] std::string toText(const cuboid_mapping::MergeProgress& progress);

/// Inverse of toText(); an empty text gives the progress of an empty map.
/// @throws std::runtime_error  for an invalid text.
[[nodiscard]] cuboid_mapping::MergeProgress mergeProgressOfText(const std::string& text);

}  // namespace cuboid_mapping_ros
