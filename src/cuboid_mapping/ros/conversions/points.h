// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <geometry_msgs/Point.h>
#include <geometry_msgs/Vector3.h>
#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/point_cloud2_iterator.h>
#include <std_msgs/Header.h>
#include <tf2_eigen/tf2_eigen.h>

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

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

[[nodiscard]] inline std_msgs::Header makeHeader(const std::string& frame_id,
                                                 const ros::Time& stamp) {
  std_msgs::Header header;
  header.frame_id = frame_id;
  header.stamp = stamp;
  return header;
}

/// Cloud with x, y and z of a scalar type, in one row; it is dense unless a number is not finite.
template <typename FieldT, typename ScalarT>
[[nodiscard]] sensor_msgs::PointCloud2 toCloudOf(
    const std::vector<Eigen::Matrix<ScalarT, 3, 1>>& points, const std_msgs::Header& header) {
  sensor_msgs::PointCloud2 cloud;
  cloud.header = header;
  cloud.is_dense = 1;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  using Field = sensor_msgs::PointField;
  const int type = sizeof(FieldT) == sizeof(double) ? Field::FLOAT64 : Field::FLOAT32;
  modifier.setPointCloud2Fields(3, "x", 1, type, "y", 1, type, "z", 1, type);
  modifier.resize(points.size());
  sensor_msgs::PointCloud2Iterator<FieldT> xyz(cloud, "x");
  for (const auto& point : points) {
    for (int axis = 0; axis < 3; ++axis) xyz[axis] = static_cast<FieldT>(point[axis]);
    if (!point.allFinite()) cloud.is_dense = 0;
    ++xyz;
  }
  return cloud;
}

/// toCloudOf() with 32-bit floats, or with doubles if a coordinate is beyond kFar_m, where floats round by more
/// than 1 mm.
template <typename ScalarT>
[[nodiscard]] sensor_msgs::PointCloud2 toCloud(
    const std::vector<Eigen::Matrix<ScalarT, 3, 1>>& points, const std_msgs::Header& header) {
  const bool is_far =
      sizeof(ScalarT) == sizeof(double) &&
      std::any_of(points.begin(), points.end(), [](const auto& point) {
        return point.allFinite() && point.template lpNorm<Eigen::Infinity>() >= kFar_m;
      });
  return is_far ? toCloudOf<double>(points, header) : toCloudOf<float>(points, header);
}

}  // namespace cuboid_mapping_ros
