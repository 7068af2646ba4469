// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/services/map_in_frame.h"

#include <cuboid_mapping/QueryBox.h>

namespace cuboid_mapping_ros {

/// Answer to ~query_box; its contract is in srv/QueryBox.srv. What check_answers.h says of waiting and errors holds
/// here, too. With more in the box than the limits allow, voxels that were not looked at count as unknown, cuboids are
/// missing, and the answer says so.
/// @complexity As cuboid_mapping::queryBox().
[[nodiscard]] cuboid_mapping::QueryBox::Response answerQueryBox(
    const MapInFrame& map, const cuboid_mapping::QueryBox::Request& request);

}  // namespace cuboid_mapping_ros
