// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>

namespace cuboid_mapping::bench {

/// What is left of objects that have passed: a simulated lidar looks into a building from one place
/// while somebody walks through it, and goes on when nobody is there any more.
///
/// @return An array with an object for each map (OctoMap, fusion and environment of ours): the voxels
///         that are occupied at the end, but free in a map of the same building in which nobody
///         ever walked ("remaining_voxels"), and those when the walker left ("left_voxels").
[[nodiscard]] nlohmann::json evaluatePassingObjects(double resolution_m);

}  // namespace cuboid_mapping::bench
