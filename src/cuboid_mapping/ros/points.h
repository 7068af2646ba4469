// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <geometry_msgs/Point.h>

namespace cuboid_mapping_ros {

[[nodiscard]] inline geometry_msgs::Point toPoint(const Eigen::Vector3d& vector) {
  geometry_msgs::Point point;
  point.x = vector.x();
  point.y = vector.y();
  point.z = vector.z();
  return point;
}

[[nodiscard]] inline Eigen::Vector3d toVector(const geometry_msgs::Point& point) {
  return {point.x, point.y, point.z};
}

}  // namespace cuboid_mapping_ros
