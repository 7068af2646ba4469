// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/conversions/byte_order.h"

#include "cuboid_mapping/ros/conversions/point_bytes.h"

#include <sensor_msgs/image_encodings.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

using sensor_msgs::Image;
using sensor_msgs::PointCloud2;
using sensor_msgs::PointField;

constexpr std::size_t kSampledNumbers = 300;

/// Whether the sender names the other order than that of this machine.
template <typename MessageT>
bool namesOtherOrder(const MessageT& message) {
  return (message.is_bigendian != 0) != (boost::endian::order::native == boost::endian::order::big);
}

template <typename MessageT>
ByteOrder makeOrder(const MessageT& message, bool is_contradicted) {
  ByteOrder order;
  order.is_other = namesOtherOrder(message);
  if (!is_contradicted) return order;
  order.is_other = !order.is_other;
  order.warning = std::string("is_bigendian is ") + (message.is_bigendian != 0 ? "true" : "false") +
                  ", but only the other byte order makes sense of the numbers, and is taken. "
                  "Correct it in the driver";
  return order;
}

/// Counts numbers that make sense as metres, in one order.
class Sense {
 public:
  void note(double number) {
    if (number == 0.0 || !std::isfinite(number)) return;  // Says nothing.
    ++num_judged_;
    if (std::abs(number) >= 1e-6 && std::abs(number) < kHuge) ++num_sane_;
    has_huge_ = has_huge_ || std::abs(number) >= kHuge;
  }
  [[nodiscard]] bool isLacking() const { return 2 * num_sane_ < num_judged_; }
  [[nodiscard]] bool isClear() const { return 10 * num_sane_ >= 9 * num_judged_; }

  /// Whether some are no lengths. Tiny ones are: those across a single beam are rounding errors.
  [[nodiscard]] bool hasHuge() const { return has_huge_; }

 private:
  static constexpr double kHuge = 1e8;

  std::size_t num_judged_ = 0;
  std::size_t num_sane_ = 0;
  bool has_huge_ = false;
};

/// Sense of numbers in the order that a message names, and in the other one.
struct Senses {
  Sense named;
  Sense other;

  template <typename T, typename BitsT>
  void note(const std::uint8_t* data, bool names_other_order) {
    named.note(readAs<T, BitsT>(data, names_other_order));
    other.note(readAs<T, BitsT>(data, !names_other_order));
  }
  [[nodiscard]] bool contradict() const { return named.isLacking() && other.isClear(); }
};

/// Depths of 16 bits in one order.
struct Depths {
  std::vector<double> depths_m;
  double variation_m = 0.0;  ///< Sum of the differences from pixel to pixel.

  [[nodiscard]] bool areUsual(double max_m) {
    if (depths_m.empty()) return false;
    const double median_m = quantileOf(depths_m);
    return median_m >= 0.05 && median_m <= max_m;
  }
};

Depths readDepths(const Image& image, double unit_m, bool is_other_order) {
  constexpr std::size_t kSampledRows = 16;
  constexpr std::uint64_t kGreatest = 0xFFFF;
  const std::size_t pixel_bytes = sizeof(std::uint16_t);
  const std::uint64_t num_pixels = image.data.size() / pixel_bytes;
  const std::uint64_t row = std::min<std::uint64_t>(image.width, num_pixels);
  Depths depths;
  if (row == 0) return depths;
  const std::uint64_t step = std::max<std::uint64_t>(image.step / pixel_bytes, row);
  const std::uint64_t num_rows = (num_pixels - row) / step + 1;
  for (std::uint64_t y = 0; y < num_rows; y += sampleStep(num_rows, kSampledRows)) {
    double last = 0.0;
    for (std::uint64_t x = 0; x < row; ++x) {
      const double number = readAs<std::uint16_t, std::uint16_t>(
          image.data.data() + pixel_bytes * (y * step + x), is_other_order);
      const bool is_depth = number > 0.0 && number < kGreatest;
      if (is_depth) depths.depths_m.push_back(unit_m * number);
      if (is_depth && last > 0.0) depths.variation_m += unit_m * std::abs(number - last);
      last = is_depth ? number : 0.0;
    }
  }
  return depths;
}

}  // namespace

ByteOrder findByteOrder(const PointCloud2& cloud) {
  const CloudLayout layout = layoutOf(cloud);
  const bool names_other_order = namesOtherOrder(cloud);
  const std::uint64_t num_points = layout.width * layout.height;
  Senses senses;
  for (const char* name : {"x", "y", "z"}) {
    const PointField* field = findField(cloud, name);
    if (field == nullptr || num_points == 0) continue;
    const bool is_double = field->datatype == PointField::FLOAT64;
    const std::uint64_t size = is_double ? sizeof(double) : sizeof(float);
    for (std::uint64_t i = 0; i < num_points; i += sampleStep(num_points, kSampledNumbers)) {
      const std::uint64_t offset =
          i / layout.width * layout.row_step + i % layout.width * layout.point_step + field->offset;
      if (offset + size > cloud.data.size()) break;
      const std::uint8_t* data = cloud.data.data() + offset;
      is_double ? senses.note<double, std::uint64_t>(data, names_other_order)
                : senses.note<float, std::uint32_t>(data, names_other_order);
    }
  }
  ByteOrder order = makeOrder(cloud, senses.contradict());
  order.makes_sense =
      !senses.named.isLacking() || !senses.named.hasHuge() || senses.other.isClear();
  return order;
}

ByteOrder findByteOrder(const Image& image, double unit_m) {
  const bool names_other_order = namesOtherOrder(image);
  if (image.encoding == sensor_msgs::image_encodings::TYPE_32FC1) {
    Senses senses;
    const std::size_t num_pixels = image.data.size() / sizeof(float);
    for (std::size_t i = 0; i < num_pixels; i += sampleStep(num_pixels, kSampledNumbers)) {
      senses.note<float, std::uint32_t>(image.data.data() + sizeof(float) * i, names_other_order);
    }
    return makeOrder(image, senses.contradict());
  }
  constexpr double kMaxDepth_m = 50.0;
  constexpr double kMaxFlatDepth_m = 20.0;  ///< Of an image that does not vary.
  constexpr double kSmoother = 4.0;
  Depths named = readDepths(image, unit_m, names_other_order);
  Depths other = readDepths(image, unit_m, !names_other_order);
  const bool is_flat = named.variation_m == 0.0 && other.variation_m == 0.0;
  const bool is_better = is_flat ? names_other_order && !named.areUsual(kMaxFlatDepth_m)
                                 : kSmoother * other.variation_m < named.variation_m;
  return makeOrder(image, is_better && other.areUsual(is_flat ? kMaxFlatDepth_m : kMaxDepth_m));
}

}  // namespace cuboid_mapping_ros
