// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/parameters/parameters.h"
#include "cuboid_mapping/ros/parameters/robot_parts.h"

#include <ros/node_handle.h>

#include <functional>
#include <optional>
#include <string>

namespace cuboid_mapping_ros {

/// The text of a parameter of this name; nothing when there is none.
using FindText = std::function<std::optional<std::string>(const std::string& name)>;

/// Looks in the private namespace of a node, and then in those around it.
[[nodiscard]] FindText findTextFrom(const ros::NodeHandle& private_nh);

/// Finds what belongs to the robot, into self_filter.parts: its boxes, then the shapes of its description.
///
/// @param find_text  Is asked for self_filter/robot_description, unless there is a urdf_file.
/// @throws std::runtime_error  for a file or a parameter that is not there, what readRobotDescription() does not
///         take, and a robot of too many voxels to keep free.
void loadRobotParts(NodeParameters& parameters, const FindText& find_text);

}  // namespace cuboid_mapping_ros
