// SPDX-License-Identifier: BSD-3-Clause
// Byte order of clouds and images. Some drivers set is_bigendian by mistake, and nobody notices, because rviz, PCL
// and octomap_server do not look at it.
#pragma once

#include <sensor_msgs/Image.h>
#include <sensor_msgs/PointCloud2.h>

#include <string>

namespace cuboid_mapping_ros {

/// Order in which the bytes of a message are read.
struct ByteOrder {
  bool is_other = false;    ///< Not the order of this machine.
  bool makes_sense = true;  ///< In one order, coordinates of a cloud could be lengths.
  std::string warning;      ///< Says that is_bigendian is wrong; else empty.
};

/// The order that is_bigendian names, unless only the other one makes sense of the coordinates: most numbers lie
/// between a micrometre and 1e8 m. @complexity O(1): reads a sample.
[[nodiscard]] ByteOrder findByteOrder(const sensor_msgs::PointCloud2& cloud);

/// As above, for depths. Those of 16 bits make sense if they are usual for a camera, and differ less from pixel to
/// pixel. @param unit_m  Unit of 16 bits.
[[nodiscard]] ByteOrder findByteOrder(const sensor_msgs::Image& image, double unit_m);

}  // namespace cuboid_mapping_ros
