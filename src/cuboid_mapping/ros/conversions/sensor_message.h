// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/LaserScan.h>
#include <sensor_msgs/PointCloud2.h>

#include <cstddef>
#include <variant>

namespace cuboid_mapping_ros {

/// A depth image with its camera.
struct DepthImage {
  sensor_msgs::Image::ConstPtr image;        ///< May be compressed: see toCompressedImage().
  sensor_msgs::CameraInfo::ConstPtr camera;  ///< See DepthPairs.
};

/// A message of a source. Other code calls it "cloud" if the type does not matter.
struct SensorMessage {
  /// The message; no pointer is null.
  std::variant<sensor_msgs::PointCloud2::ConstPtr, sensor_msgs::LaserScan::ConstPtr, DepthImage>
      content;
  std::size_t source = 0;  ///< Index of its source in sourcesOf().

  /// Stamp and frame of the measurement.
  [[nodiscard]] const std_msgs::Header& header() const;
  /// Size in memory in bytes.
  [[nodiscard]] std::size_t numBytes() const;
};

}  // namespace cuboid_mapping_ros
