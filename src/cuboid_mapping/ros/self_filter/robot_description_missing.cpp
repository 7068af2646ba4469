// SPDX-License-Identifier: BSD-3-Clause
// Replaces robot_description.cpp in builds without urdf or geometric_shapes.
#include "cuboid_mapping/ros/self_filter/robot_description.h"

#include <stdexcept>

namespace cuboid_mapping_ros {

bool canReadRobotDescriptions() { return false; }

RobotParts readRobotDescription(const std::string& /*urdf*/, double /*padding_m*/,
                                const std::set<std::string>& /*ignored_links*/) {
  throw std::runtime_error(
      "this build cannot read robot descriptions: install liburdf-dev and libgeometric-shapes-dev "
      "(ROS Noetic: ros-noetic-urdf and ros-noetic-geometric-shapes) and build again, or list "
      "boxes in self_filter/boxes");
}

}  // namespace cuboid_mapping_ros
