// SPDX-License-Identifier: BSD-3-Clause
#pragma once

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

/// A cloud of x, y and z as 32-bit floats, in one row; it is dense unless a number is not finite.
template <typename ScalarT>
[[nodiscard]] sensor_msgs::PointCloud2 toCloud(
    const std::vector<Eigen::Matrix<ScalarT, 3, 1>>& points, const std_msgs::Header& header) {
  sensor_msgs::PointCloud2 cloud;
  cloud.header = header;
  cloud.is_dense = 1;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  using Field = sensor_msgs::PointField;
  modifier.setPointCloud2Fields(3, "x", 1, Field::FLOAT32, "y", 1, Field::FLOAT32, "z", 1,
                                Field::FLOAT32);
  modifier.resize(points.size());
  sensor_msgs::PointCloud2Iterator<float> xyz(cloud, "x");
  for (const auto& point : points) {
    const Eigen::Vector3f& floats = point.template cast<float>();
    std::copy_n(floats.data(), floats.size(), &xyz[0]);
    if (!point.allFinite()) cloud.is_dense = 0;
    ++xyz;
  }
  return cloud;
}

}  // namespace cuboid_mapping_ros
