// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/conversions/points.h"

#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/point_cloud2_iterator.h>
#include <std_msgs/Header.h>

#include <Eigen/Core>

#include <algorithm>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

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

/// toCloudOf() with 32-bit floats, or with doubles if a coordinate is beyond kFar_m, where floats round by more than 1 mm.
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
