// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/services/map_in_frame.h"

#include <cuboid_mapping/CastRays.h>
#include <cuboid_mapping/CheckBoxes.h>
#include <cuboid_mapping/CheckPath.h>

namespace cuboid_mapping_ros {

// Answers to the services of the same names; their contracts are in srv/. They look at the map as the
// last cloud has left it; in a long answer clouds come in between. They keep within the limits of the
// MapInFrame, wait for changes that are under way, never for tf, and do not throw but for want of
// memory.

/// @complexity O(bricks of the box) for each.
[[nodiscard]] cuboid_mapping::CheckBoxes::Response answerCheckBoxes(
    const MapInFrame& map, const cuboid_mapping::CheckBoxes::Request& request);

/// @complexity As cuboid_mapping::checkPath for each path.
[[nodiscard]] cuboid_mapping::CheckPath::Response answerCheckPath(
    const MapInFrame& map, const cuboid_mapping::CheckPath::Request& request);

/// @complexity As cuboid_mapping::castRay for each ray.
[[nodiscard]] cuboid_mapping::CastRays::Response answerCastRays(
    const MapInFrame& map, const cuboid_mapping::CastRays::Request& request);

}  // namespace cuboid_mapping_ros
