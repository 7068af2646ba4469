// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include <algorithm>
#include <string>
#include <vector>

namespace cuboid_mapping_ros::test {

/// Whether the node has these parameters: scripts/without builds it without some features.
inline bool hasParameters(const std::vector<std::string>& keys) {
  return std::all_of(keys.begin(), keys.end(), [](const std::string& key) {
    return std::any_of(parameterTable().begin(), parameterTable().end(),
                       [&key](const auto& declaration) { return declaration.key == key; });
  });
}

/// Whether no feature is left out.
inline bool hasAllFeatures() {
  return hasParameters({"deskew", "self_filter/boxes", "filter_ground",
                        "sensor_model/no_return_range", "moving_points", "forget_after",
                        "start_free", "window/frame", "keep_clouds/memory", "autosave_file",
                        "publish_values", "observation_rate", "occupancy_min_z",
                        "robot_grid/frame"});
}

}  // namespace cuboid_mapping_ros::test
