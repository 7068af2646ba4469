// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/parameters/parameters.h"
#include "cuboid_mapping/ros/parameters/robot_parts.h"

#include <ros/node_handle.h>

#include <functional>
#include <optional>
#include <string>

namespace cuboid_mapping_ros {

/// Text of the parameter of this name; nothing if there is none.
using FindText = std::function<std::optional<std::string>(const std::string& name)>;

/// Looks in the private namespace of a node, and then in the namespaces above it.
[[nodiscard]] FindText findTextFrom(const ros::NodeHandle& private_nh);

/// Fills self_filter.parts with the parts of the robot: its boxes, then the shapes of its description.
///
/// @param find_text  Reads self_filter/robot_description, unless there is a urdf_file.
/// @throws std::runtime_error  for a missing file or parameter, errors of readRobotDescription(), and
///         a robot with too many voxels to keep free.
void loadRobotParts(NodeParameters& parameters, const FindText& find_text);

}  // namespace cuboid_mapping_ros
