// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/conversions/points.h"

#include <geometry_msgs/TransformStamped.h>
#include <tf2_eigen/tf2_eigen.h>

#include <string>

namespace cuboid_mapping_ros {

/// Pose of a frame in another one.
[[nodiscard]] inline geometry_msgs::TransformStamped toTransformMessage(
    const Eigen::Isometry3d& T_parent_child, const ros::Time& stamp, const std::string& parent,
    const std::string& child) {
  geometry_msgs::TransformStamped message = tf2::eigenToTransform(T_parent_child);
  message.header = makeHeader(parent, stamp);
  message.child_frame_id = child;
  return message;
}

}  // namespace cuboid_mapping_ros
