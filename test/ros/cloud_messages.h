// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// PointCloud2 messages of any layout, for the tests of their conversion.

#include "cuboid_mapping/ros/conversions/cloud_conversions.h"
#include "cuboid_mapping/ros/conversions/sensor_conversions.h"

#include "support/random.h"

#include <gtest/gtest.h>
#include <boost/endian/conversion.hpp>
#include <boost/make_shared.hpp>

#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <variant>
#include <vector>

namespace cuboid_mapping_ros {

using sensor_msgs::PointCloud2;
using sensor_msgs::PointField;

/// Layout of a message; the points follow row by row.
struct CloudSpec {
  std::uint32_t width = 0;
  std::uint32_t height = 1;
  std::array<std::uint8_t, 3> datatypes{PointField::FLOAT32, PointField::FLOAT32,
                                        PointField::FLOAT32};
  std::array<std::uint32_t, 3> offsets{0, 4, 8};
  std::uint32_t point_step = 12;
  std::uint32_t row_padding = 0;
  bool is_bigendian = false;
};

/// Writes a number of type T, whose bits are an integer of type BitsT, in a byte order.
template <typename T, typename BitsT>
void writeAs(double number, bool is_bigendian, std::uint8_t* data) {
  const auto value = static_cast<T>(number);
  BitsT bits;
  std::memcpy(&bits, &value, sizeof(bits));
  if (is_bigendian) {
    boost::endian::native_to_big_inplace(bits);
  } else {
    boost::endian::native_to_little_inplace(bits);
  }
  std::memcpy(data, &bits, sizeof(bits));
}

/// A message of these points in frame "lidar"; padding is filled with 0xAB.
inline PointCloud2 makeMessage(const CloudSpec& spec, const std::vector<Eigen::Vector3d>& points) {
  PointCloud2 message;
  message.header.frame_id = "lidar";
  message.width = spec.width;
  message.height = spec.height;
  message.point_step = spec.point_step;
  message.row_step = spec.width * spec.point_step + spec.row_padding;
  message.is_bigendian = spec.is_bigendian ? 1 : 0;
  message.is_dense = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    PointField field;
    field.name = std::string(1, "xyz"[axis]);
    field.offset = spec.offsets[axis];
    field.datatype = spec.datatypes[axis];
    field.count = 1;
    message.fields.push_back(field);
  }
  message.data.assign(std::size_t{message.row_step} * message.height, 0xAB);
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::uint8_t* point = message.data.data() + i / spec.width * message.row_step +
                          i % spec.width * message.point_step;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double value = points[i][static_cast<Eigen::Index>(axis)];
      std::uint8_t* data = point + spec.offsets[axis];
      if (spec.datatypes[axis] == PointField::FLOAT64) {
        writeAs<double, std::uint64_t>(value, spec.is_bigendian, data);
      } else {
        writeAs<float, std::uint32_t>(value, spec.is_bigendian, data);
      }
    }
  }
  return message;
}

/// A message from a source.
inline SensorMessage makeSensorMessage(const CloudSpec& spec,
                                       const std::vector<Eigen::Vector3d>& points) {
  return {boost::make_shared<PointCloud2>(makeMessage(spec, points))};
}

/// Random points within 50 m.
inline std::vector<Eigen::Vector3d> makePoints(std::size_t count,
                                               cuboid_mapping::test::Random& random) {
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < count; ++i) {
    points.emplace_back(random.real(-50, 50), random.real(-50, 50), random.real(-50, 50));
  }
  return points;
}

/// Result of convertCloud() for a message that must be accepted.
inline CloudPoints convertGood(const PointCloud2& message, const CloudOptions& options = {}) {
  auto result = convertCloud(message, options);
  if (const auto* error = std::get_if<CloudError>(&result)) {
    ADD_FAILURE() << error->text;
    return {};
  }
  return std::get<CloudPoints>(result);
}

}  // namespace cuboid_mapping_ros
