// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/services/map_in_frame.h"

#include <cuboid_mapping/SetBox.h>

namespace cuboid_mapping_ros {

/// Bricks of 8 x 8 x 8 voxels that one ~set_box may make free or occupied: each takes memory.
constexpr double kMaxSetBricks = 2e6;

/// Answer to ~set_box; its contract is in srv/SetBox.srv. When one of the boxes is refused, none is
/// set. Others get their turn at the map after every box, and after some milliseconds of a large one.
/// When there is not enough memory, what was set until then stays.
[[nodiscard]] cuboid_mapping::SetBox::Response answerSetBox(
    const MapInFrame& map, const cuboid_mapping::SetBox::Request& request);

}  // namespace cuboid_mapping_ros
