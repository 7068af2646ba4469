// SPDX-License-Identifier: BSD-3-Clause
// Reads numbers from the bytes of clouds and images whose description may be wrong.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <boost/endian/conversion.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {

/// Step of a sample: every so many rows, points or pixels. It is odd, because every second one may be empty.
[[nodiscard]] constexpr std::size_t sampleStep(std::size_t num_items, std::size_t num_samples) {
  return num_items / num_samples | 1U;
}

/// The value below which a percentage of the others lie: 50 for the median. Changes their order. @pre There are values.
template <typename T>
[[nodiscard]] T quantileOf(std::vector<T>& values, std::size_t percent = 50) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() * percent / 100);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// The field of this name; null if there is none.
[[nodiscard]] inline const sensor_msgs::PointField* findField(const sensor_msgs::PointCloud2& cloud,
                                                              const std::string& name) {
  for (const sensor_msgs::PointField& field : cloud.fields) {
    if (field.name == name) return &field;
  }
  return nullptr;
}

/// Layout of the points in a cloud's data.
struct CloudLayout {
  std::uint64_t width;
  std::uint64_t height;
  std::uint64_t point_step;
  std::uint64_t row_step;

  /// Bytes from the first point to the end of the last. @pre There are points.
  [[nodiscard]] std::uint64_t numBytes() const {
    // All of these are below 2^32, or divide the size of the data: no overflow.
    return (height - 1) * row_step + width * point_step;
  }

  /// Calls visit(offset of a point in the data), row by row.
  template <typename VisitorT>
  void forEachPoint(const VisitorT& visit) const {
    for (std::uint64_t row = 0; row < height; ++row) {
      for (std::uint64_t column = 0; column < width; ++column) {
        visit(row * row_step + column * point_step);
      }
    }
  }
};

/// Bytes of a point up to the end of x, y and z.
[[nodiscard]] inline std::uint64_t endOfFields(const sensor_msgs::PointCloud2& cloud) {
  std::uint64_t end = 0;
  for (const char* name : {"x", "y", "z"}) {
    const sensor_msgs::PointField* field = findField(cloud, name);
    if (field == nullptr) continue;
    const bool is_double = field->datatype == sensor_msgs::PointField::FLOAT64;
    end = std::max(end, field->offset + std::uint64_t{is_double ? sizeof(double) : sizeof(float)});
  }
  return end;
}

/// The layout that a message describes. An impossible number is replaced if the size of the data allows only one value:
/// height or width 0, a point_step that is less than the fields x, y and z, and any row_step, if the rows have no gaps.
[[nodiscard]] inline CloudLayout layoutOf(const sensor_msgs::PointCloud2& cloud) {
  const std::uint64_t num_bytes = cloud.data.size();
  CloudLayout layout{cloud.width, cloud.height, cloud.point_step, cloud.row_step};
  if (layout.width == 0) std::swap(layout.width, layout.height);
  if (num_bytes == 0 || layout.width == 0) return layout;
  const std::uint64_t given_row_bytes = layout.width * layout.point_step;
  if (layout.height == 0 && given_row_bytes == num_bytes) layout.height = 1;
  if (layout.height == 0) return layout;
  const std::uint64_t num_points = layout.width * layout.height;
  if (layout.point_step < endOfFields(cloud) && num_bytes % num_points == 0 &&
      num_bytes / num_points >= endOfFields(cloud)) {
    layout.point_step = num_bytes / num_points;
  }
  const std::uint64_t row_bytes = layout.width * layout.point_step;
  if (row_bytes == 0) return layout;
  const bool has_no_gaps = num_bytes % row_bytes == 0 && num_bytes / row_bytes == layout.height;
  if (has_no_gaps) layout.row_step = row_bytes;
  return layout;
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
