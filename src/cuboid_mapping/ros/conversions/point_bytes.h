// SPDX-License-Identifier: BSD-3-Clause
// Where the numbers of a sensor_msgs/PointCloud2 are among its bytes, for those who do not trust it.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <boost/endian/conversion.hpp>

#include <cstdint>
#include <cstring>

namespace cuboid_mapping_ros {

/// Whether the numbers of a cloud are in the other byte order than this machine's.
[[nodiscard]] inline bool isOtherOrder(const sensor_msgs::PointCloud2& cloud) {
  return (cloud.is_bigendian != 0) != (boost::endian::order::native == boost::endian::order::big);
}

/// Bytes from the first point of a cloud to the end of the last. @pre It has points.
[[nodiscard]] inline std::uint64_t numPointBytes(const sensor_msgs::PointCloud2& cloud) {
  // All of these are below 2^32, and a row of bytes is where there is more than one row: no overflow.
  return (cloud.height - std::uint64_t{1}) * cloud.row_step +
         std::uint64_t{cloud.width} * cloud.point_step;
}

/// Reads a number of type T that is stored as an unsigned integer of its size.
template <typename T, typename BitsT>
[[nodiscard]] double readAs(const std::uint8_t* data, bool is_other_order) {
  static_assert(sizeof(T) == sizeof(BitsT), "the bits of the number");
  BitsT bits;
  std::memcpy(&bits, data, sizeof(bits));
  if (is_other_order) bits = boost::endian::endian_reverse(bits);
  T value;
  std::memcpy(&value, &bits, sizeof(value));
  return static_cast<double>(value);
}

}  // namespace cuboid_mapping_ros
