// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/conversions/compressed_depth.h"
#include "cuboid_mapping/ros/conversions/point_bytes.h"
#include "cuboid_mapping/ros/conversions/sensor_conversions.h"

#include <sensor_msgs/image_encodings.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>

namespace cuboid_mapping_ros {
namespace {

using sensor_msgs::CameraInfo;
using sensor_msgs::Image;

CloudError makeError(DropReason defect, const Image& image, const std::string& what,
                     const char* cure = nullptr) {
  return describeError(defect, "depth image", image.header, what, cure);
}

/// Viewing direction of the pixel (u, v): ((u - cx) / fx, (v - cy) / fy, 1).
struct Pinhole {
  double fx;
  double fy;
  double cx;
  double cy;
};

/// Model of image_geometry::PinholeCameraModel, for pixels of the image as sent.
Pinhole makePinhole(const CameraInfo& camera) {
  const bool has_projection = camera.P[0] != 0.0;
  Pinhole pinhole = has_projection ? Pinhole{camera.P[0], camera.P[5], camera.P[2], camera.P[6]}
                                   : Pinhole{camera.K[0], camera.K[4], camera.K[2], camera.K[5]};
  pinhole.cx -= camera.roi.x_offset;
  pinhole.cy -= camera.roi.y_offset;
  const double binning_x = std::max(1U, camera.binning_x);
  const double binning_y = std::max(1U, camera.binning_y);
  return {pinhole.fx / binning_x, pinhole.fy / binning_y, pinhole.cx / binning_x,
          pinhole.cy / binning_y};
}

bool isUsable(const Pinhole& pinhole) {
  return std::isfinite(pinhole.cx) && std::isfinite(pinhole.cy) && std::isnormal(pinhole.fx) &&
         std::isnormal(pinhole.fy);
}

/// Bytes of a pixel; 0 if the encoding has no depths.
std::size_t pixelBytes(const Image& image) {
  namespace encodings = sensor_msgs::image_encodings;
  if (image.encoding == encodings::TYPE_32FC1) return sizeof(float);
  const bool is_16_bit = image.encoding == encodings::TYPE_16UC1 ||
                         image.encoding == encodings::TYPE_16SC1 ||
                         image.encoding == encodings::MONO16;
  return is_16_bit ? sizeof(std::uint16_t) : 0;
}

/// Bytes from row to row: the image's own value, unless it is impossible and the size of the data allows only
/// one.
std::uint64_t stepOf(const Image& image) {
  const std::uint64_t row_bytes = std::uint64_t{image.width} * pixelBytes(image);
  const bool has_no_gaps = row_bytes != 0 && image.data.size() % row_bytes == 0 &&
                           image.data.size() / row_bytes == image.height;
  return has_no_gaps ? row_bytes : image.step;
}

/// Image size of a camera; 0 if it is not given.
std::array<std::uint64_t, 2> sizeOf(const CameraInfo& camera) {
  const bool has_roi = camera.roi.width != 0 && camera.roi.height != 0;
  return {(has_roi ? camera.roi.width : camera.width) / std::max(1U, camera.binning_x),
          (has_roi ? camera.roi.height : camera.height) / std::max(1U, camera.binning_y)};
}

/// Checks the size: with intrinsics of another size, points would silently lie elsewhere.
std::optional<CloudError> checkSize(const Image& image, const CameraInfo& camera) {
  const auto [width, height] = sizeOf(camera);
  const bool is_other =
      (width != 0 && width != image.width) || (height != 0 && height != image.height);
  if (!is_other) return std::nullopt;
  return makeError(DropReason::kBadLayout, image,
                   "it has " + std::to_string(image.width) + " x " + std::to_string(image.height) +
                       " pixels, but its camera_info is of " + std::to_string(width) + " x " +
                       std::to_string(height),
                   "Name the camera_info of this image in camera_info, or correct its binning");
}

std::optional<CloudError> checkImage(const Image& image, const Pinhole& pinhole) {
  if (image.header.frame_id.empty()) {
    return makeError(DropReason::kEmptyFrame, image, "header.frame_id is empty");
  }
  if (image.width == 0 || image.height == 0) {
    return makeError(DropReason::kNoPoints, image, "it has no pixels");
  }
  const std::size_t pixel_bytes = pixelBytes(image);
  if (pixel_bytes == 0) {
    return makeError(DropReason::kWrongDatatype, image,
                     "its encoding is '" + image.encoding + "', but must be 16UC1 or 32FC1",
                     "Connect the topic of the depth image, not that of colours");
  }
  const std::uint64_t row_bytes = image.width * pixel_bytes;
  const std::uint64_t step = stepOf(image);
  if (step < row_bytes) {
    return makeError(DropReason::kBadLayout, image,
                     "step " + std::to_string(step) + " is less than a row of " +
                         std::to_string(row_bytes) + " bytes");
  }
  const std::uint64_t num_bytes = (image.height - std::uint64_t{1}) * step + row_bytes;
  if (image.data.size() < num_bytes) {
    return makeError(DropReason::kShortData, image,
                     "it has " + std::to_string(image.data.size()) + " bytes of data, but needs " +
                         std::to_string(num_bytes));
  }
  if (!isUsable(pinhole)) {
    return makeError(DropReason::kBadLayout, image, "its camera_info has no focal length",
                     "Calibrate the camera, or connect the camera_info of its driver");
  }
  return std::nullopt;
}

/// Reads depths of a checked image, in metres.
class DepthReader {
 public:
  DepthReader(const Image& image, double unit_m)
      : image_(image),
        unit_m_(unit_m),
        greatest_(image.encoding == sensor_msgs::image_encodings::TYPE_16SC1 ? 0x7FFF : 0xFFFF),
        step_(stepOf(image)),
        pixel_bytes_(pixelBytes(image)),
        is_other_order_(isOtherOrder(image)) {}

  /// Whether its numbers count units, not metres.
  [[nodiscard]] bool hasUnits() const { return pixel_bytes_ == sizeof(std::uint16_t); }

  [[nodiscard]] double read(std::size_t row, std::size_t column) const {
    const std::uint8_t* pixel = image_.data.data() + row * step_ + column * pixel_bytes_;
    if (pixel_bytes_ == sizeof(std::uint16_t)) {
      const double number = readAs<std::uint16_t, std::uint16_t>(pixel, is_other_order_);
      // The greatest number stands for everything beyond the sensor's reach; negative numbers are invalid.
      return number == greatest_  ? std::numeric_limits<double>::infinity()
             : number < greatest_ ? unit_m_ * number
                                  : -unit_m_;
    }
    return readAs<float, std::uint32_t>(pixel, is_other_order_);
  }

 private:
  const Image& image_;
  double unit_m_;
  double greatest_;
  std::uint64_t step_;
  std::size_t pixel_bytes_;
  bool is_other_order_;
};

}  // namespace

ConvertedCloud convertDepthImage(const DepthImage& depth, const CloudOptions& options) {
  if (isCompressed(*depth.image)) {
    const auto image = decompress(*depth.image);
    if (const auto* error = std::get_if<std::string>(&image)) {
      return makeError(DropReason::kBadLayout, *depth.image, *error, "");
    }
    return convertDepthImage({std::get<Image::ConstPtr>(image), depth.camera}, options);
  }
  const Image& image = *depth.image;
  const Pinhole pinhole = makePinhole(*depth.camera);
  if (auto error = checkImage(image, pinhole)) return *error;
  if (auto error = checkSize(image, *depth.camera)) return *error;
  const DepthReader reader(image, options.depth_unit_m);
  CloudPoints cloud;
  if (pinhole.fx < 0.0 || pinhole.fy < 0.0) {
    cloud.warning =
        "camera_info has a negative focal length: the points are mirrored, unless y of frame '" +
        image.header.frame_id + "' points up. Make it positive for optical frames";
  }
  // A depth of no_return_points may be a number of units, such as 65534.
  const bool has_units = reader.hasUnits();
  cloud.points.reserve(std::size_t{image.width} * image.height);
  for (std::size_t row = 0; row < image.height; ++row) {
    for (std::size_t column = 0; column < image.width; ++column) {
      const double depth_m = reader.read(row, column);
      const Eigen::Vector3d ray((static_cast<double>(column) - pinhole.cx) / pinhole.fx,
                                (static_cast<double>(row) - pinhole.cy) / pinhole.fy, 1.0);
      const NoReturnPoints reading = classifyReading(depth_m);
      const bool is_named =
          contains(options.no_return_ranges_m, depth_m) ||
          (has_units && contains(options.no_return_ranges_m, depth_m / options.depth_unit_m));
      if (reading == NoReturnPoints::kNone && depth_m > 0.0 && !is_named) {
        cloud.points.emplace_back((depth_m * ray).cast<float>());
        continue;
      }
      ++cloud.num_invalid;
      const bool is_wanted = is_named || contains(options.no_return_points, reading);
      if (!is_wanted || options.no_return_range_m <= 0.0) continue;
      cloud.no_returns.emplace_back((options.no_return_range_m * ray.normalized()).cast<float>());
    }
  }
  cloud.num_skipped = cloud.num_invalid - cloud.no_returns.size();
  if (cloud.points.empty() && cloud.no_returns.empty()) {
    return makeError(DropReason::kNoValidPoints, image,
                     "all of its " + std::to_string(cloud.num_invalid) + " pixels have no depth");
  }
  return cloud;
}

}  // namespace cuboid_mapping_ros
