// SPDX-License-Identifier: BSD-3-Clause
// Internal to self_filter_step.h: the collision shapes of a URDF.
#pragma once

#include "cuboid_mapping/ros/parameters/parameters.h"

#include <set>
#include <string>

namespace cuboid_mapping_ros {

/// Whether this build can read URDFs: urdf and geometric_shapes were found.
[[nodiscard]] bool canReadRobotDescriptions();

/// The collision shapes of a robot, each in the frame of its link. A mesh counts as its convex hull.
///
/// @param urdf  Text of the URDF. @param padding_m  >= 0. @param ignored_links  Links whose shapes are left
///              out.
/// @throws std::runtime_error  for an invalid URDF, a mesh that cannot be read, a link to be ignored that does
///         not exist, no shape at all; and if this build cannot read URDFs.
[[nodiscard]] RobotParts readRobotDescription(const std::string& urdf, double padding_m,
                                              const std::set<std::string>& ignored_links);

}  // namespace cuboid_mapping_ros
