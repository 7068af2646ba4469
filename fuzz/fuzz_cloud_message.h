// SPDX-License-Identifier: BSD-3-Clause
// Clouds with arbitrary fields, sizes, strides and byte order.
#pragma once

#include "fuzz_input.h"

#include <sensor_msgs/PointCloud2.h>

#include <cstdint>
#include <string>

namespace cuboid_mapping {

/// Sizes that are mostly small and consistent, but may be any number.
inline std::uint32_t takeSize(FuzzInput& input, std::uint32_t usual) {
  switch (input.upTo(7)) {
    case 0: return input.take<std::uint32_t>();
    case 1: return static_cast<std::uint32_t>(input.upTo(32));
    default: return usual;
  }
}

inline sensor_msgs::PointField takeField(FuzzInput& input, std::uint32_t index) {
  const char* names[] = {"x", "y", "z", "rgb", ""};
  sensor_msgs::PointField field;
  field.name = names[input.chance() ? index : input.upTo(4)];
  field.offset = takeSize(input, 4 * index);
  field.count = takeSize(input, 1);
  field.datatype = input.upTo(15) == 0 ? input.take<std::uint8_t>()
                                       : std::uint8_t{sensor_msgs::PointField::FLOAT32};
  return field;
}

/// Shape of most clouds; a cloud has rows and columns with 1 up to this many points.
struct CloudShape {
  std::size_t max_height;
  std::size_t max_width;
  std::uint32_t point_step;
};

/// Fills a cloud with the bytes, repeated, so that most clouds have all their points.
inline void fillCloud(sensor_msgs::PointCloud2& cloud, const std::string& data) {
  cloud.data.assign(data.begin(), data.end());
  const std::size_t wanted = std::size_t{cloud.row_step} * cloud.height;
  if (wanted > data.size() && wanted < 4096 && !data.empty()) {
    for (std::size_t i = data.size(); i < wanted; ++i) {
      cloud.data.push_back(static_cast<std::uint8_t>(data[i % data.size()]));
    }
  }
}

/// Sets everything but the fields of a cloud.
inline void takeContent(FuzzInput& input, const CloudShape& usual,
                        sensor_msgs::PointCloud2& cloud) {
  cloud.is_bigendian = static_cast<std::uint8_t>(input.chance());
  cloud.height = takeSize(input, 1 + static_cast<std::uint32_t>(input.upTo(usual.max_height - 1)));
  cloud.point_step = takeSize(input, usual.point_step);
  cloud.width = takeSize(input, 1 + static_cast<std::uint32_t>(input.upTo(usual.max_width - 1)));
  cloud.row_step = takeSize(input, cloud.width * cloud.point_step);
  fillCloud(cloud, input.rest());
}

inline sensor_msgs::PointCloud2 takeCloud(FuzzInput& input) {
  sensor_msgs::PointCloud2 cloud;
  cloud.header.frame_id = "lidar";
  const auto num_fields = static_cast<std::uint32_t>(input.upTo(4));
  for (std::uint32_t i = 0; i < num_fields; ++i) cloud.fields.push_back(takeField(input, i));
  takeContent(input, {8, 32, 12}, cloud);
  return cloud;
}

}  // namespace cuboid_mapping
