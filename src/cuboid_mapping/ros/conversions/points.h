// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <geometry_msgs/Point.h>
#include <geometry_msgs/Vector3.h>
#include <tf2_eigen/tf2_eigen.h>

namespace cuboid_mapping_ros {

[[nodiscard]] inline geometry_msgs::Point toPoint(const Eigen::Vector3d& vector) {
  return tf2::toMsg(vector);
}

[[nodiscard]] inline geometry_msgs::Vector3 toVector3(const Eigen::Vector3d& vector) {
  geometry_msgs::Vector3 message;
  return tf2::toMsg(vector, message);
}

[[nodiscard]] inline Eigen::Vector3d toVector(const geometry_msgs::Point& point) {
  return {point.x, point.y, point.z};
}

}  // namespace cuboid_mapping_ros
