// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/query_box.h"

#include <cuboid_mapping/SetBox.h>

namespace cuboid_mapping_ros {

/// Voxels that one ~set_box may make free or occupied: each brick of them takes memory.
constexpr double kMaxSetVoxels = 1e9;

/// Answer to ~set_box; its contract is in srv/SetBox.srv. All boxes are set in one revision, or, when
/// one of them is refused, none.
[[nodiscard]] cuboid_mapping::SetBox::Response answerSetBox(
    const MapInFrame& map, const cuboid_mapping::SetBox::Request& request);

}  // namespace cuboid_mapping_ros
