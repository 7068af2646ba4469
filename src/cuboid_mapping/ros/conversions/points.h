// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <geometry_msgs/Point.h>
#include <geometry_msgs/Vector3.h>
#include <tf2_eigen/tf2_eigen.h>

#include <cmath>

namespace cuboid_mapping_ros {

/// Distance in metres beyond which viewers and clouds of 32-bit floats are off by a millimetre.
constexpr double kFar_m = 16384.0;

/// Anchor near a point, from which coordinates fit into 32-bit floats: on each axis 0, or far away the nearest
/// multiple of 1024 m.
[[nodiscard]] inline Eigen::Vector3d farAnchor(const Eigen::Vector3d& point) {
  return point.unaryExpr(
      [](double v) { return std::abs(v) < kFar_m ? 0.0 : 1024.0 * std::round(v / 1024.0); });
}

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
