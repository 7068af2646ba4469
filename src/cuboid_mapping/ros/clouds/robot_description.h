// SPDX-License-Identifier: BSD-3-Clause
// Inside of self_filter.h: the collision shapes of a URDF.
#pragma once

#include "cuboid_mapping/ros/parameters/robot_parts.h"

#include <set>
#include <string>

namespace cuboid_mapping_ros {

/// Whether this build can: urdf and geometric_shapes were found.
[[nodiscard]] bool canReadRobotDescriptions();

/// The collision shapes of a robot, each in the frame of its link. A mesh counts as its convex hull.
///
/// @param urdf  Its text. @param padding_m  >= 0. @param ignored_links  Their shapes are left out.
/// @throws std::runtime_error  for what is no URDF, a mesh that cannot be read, a link to be ignored that is not
///         there, no shape at all; and where this build cannot read URDFs.
[[nodiscard]] RobotParts readRobotDescription(const std::string& urdf, double padding_m,
                                              const std::set<std::string>& ignored_links);

}  // namespace cuboid_mapping_ros
