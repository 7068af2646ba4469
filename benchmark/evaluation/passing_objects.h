// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>

namespace cuboid_mapping::bench {

/// What is left of objects that have passed: a simulated lidar drives slowly through a building where
/// somebody walks, and goes on when nobody is there any more.
///
/// @param num_drives  >= 1; each has a building and a walk of its own.
/// @return An array with an object for each map and seed (OctoMap; fusion, environment and settling
///         time of ours): the voxels that are occupied at the end, but free in a map of the same kind
///         of the same drive on which nobody walked ("remaining_voxels"), and those when the walker
///         left ("left_voxels"); every ten clouds ("over_time") the cells, CPU seconds of these ten
///         and, of ours, splits and voxels that have fused again since the beginning.
[[nodiscard]] nlohmann::json evaluatePassingObjects(double resolution_m, int num_drives);

}  // namespace cuboid_mapping::bench
