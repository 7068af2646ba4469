// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/conversions/byte_order.h"
#include "cuboid_mapping/ros/conversions/compressed_depth.h"
#include "cuboid_mapping/ros/conversions/point_bytes.h"
#include "cuboid_mapping/ros/conversions/sensor_conversions.h"

#include <sensor_msgs/image_encodings.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>
#include <string>
#include <vector>

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
  const bool has_projection = std::isnormal(camera.P[0]) && std::isnormal(camera.P[5]);
  Pinhole pinhole = has_projection ? Pinhole{camera.P[0], camera.P[5], camera.P[2], camera.P[6]}
                                   : Pinhole{camera.K[0], camera.K[4], camera.K[2], camera.K[5]};
  pinhole.cx -= camera.roi.x_offset;
  pinhole.cy -= camera.roi.y_offset;
  const double binning_x = std::max(1U, camera.binning_x);
  const double binning_y = std::max(1U, camera.binning_y);
  return {pinhole.fx / binning_x, pinhole.fy / binning_y, pinhole.cx / binning_x,
          pinhole.cy / binning_y};
}

/// Whether a raw image of the camera is bent by more than a pixel or so.
bool isDistorted(const CameraInfo& camera) {
  constexpr double kLeast = 0.01;
  return std::any_of(camera.D.begin(), camera.D.end(),
                     [](double coefficient) { return std::abs(coefficient) > kLeast; });
}

/// Whether the principal point was left unset.
bool hasNoCentre(const CameraInfo& camera) {
  return camera.K[2] == 0.0 && camera.K[5] == 0.0 && camera.P[2] == 0.0 && camera.P[6] == 0.0;
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

/// The unit of REP 118.
double usualUnit_m(const Image& image) {
  return pixelBytes(image) == sizeof(std::uint16_t) ? 1e-3 : 1.0;
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

/// Whether the pixels have more bytes than their encoding: the step has a larger whole number of bytes a pixel, and
/// zeros do not just fill the rows. @pre step is at least a row.
bool hasLargerPixels(const Image& image) {
  const std::uint64_t step = stepOf(image);
  const std::uint64_t row_bytes = image.width * pixelBytes(image);
  if (step == row_bytes || step % image.width != 0) return false;
  const std::uint8_t* row = image.data.data();
  const std::uint8_t* const end = row + image.data.size();
  for (; static_cast<std::uint64_t>(end - row) >= step; row += step) {
    if (std::any_of(row + row_bytes, row + step, [](std::uint8_t byte) { return byte != 0; })) {
      return true;
    }
  }
  return false;
}

std::optional<CloudError> checkImage(const Image& image, const Pinhole& pinhole) {
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
  if (hasLargerPixels(image)) {
    return makeError(DropReason::kBadLayout, image,
                     "it has " + std::to_string(step / image.width) +
                         " bytes a pixel, but encoding " + image.encoding + " has " +
                         std::to_string(pixel_bytes),
                     "Correct the encoding in the driver");
  }
  if (!isUsable(pinhole)) {
    return makeError(DropReason::kBadLayout, image, "its camera_info has no focal length",
                     "Calibrate the camera, or connect the camera_info of its driver");
  }
  constexpr double kMaxWidth = 20.0;  ///< In focal lengths: 168 degrees.
  if (image.width > kMaxWidth * std::abs(pinhole.fx)) {
    return makeError(DropReason::kBadLayout, image,
                     "its camera_info has a focal length of " + cuboid_mapping::toText(pinhole.fx) +
                         " pixels, in an image " + std::to_string(image.width) + " wide",
                     "Write K and P of camera_info in pixels");
  }
  return std::nullopt;
}

/// Reads depths of a checked image, in metres.
class DepthReader {
 public:
  DepthReader(const Image& image, double unit_m, bool is_other_order)
      : image_(image),
        unit_m_(unit_m),
        greatest_(image.encoding == sensor_msgs::image_encodings::TYPE_16SC1 ? 0x7FFF : 0xFFFF),
        step_(stepOf(image)),
        pixel_bytes_(pixelBytes(image)),
        is_other_order_(is_other_order) {}

  /// Whether its numbers count units, not metres.
  [[nodiscard]] bool hasUnits() const { return pixel_bytes_ == sizeof(std::uint16_t); }

  [[nodiscard]] double unit_m() const { return unit_m_; }
  void setUnit(double unit_m) { unit_m_ = unit_m; }

  /// @param depths_m  One for each column.
  void readRow(std::size_t row, std::vector<double>& depths_m) const {
    const std::uint8_t* pixel = image_.data.data() + row * step_;
    if (!hasUnits()) {
      for (double& depth_m : depths_m) {
        depth_m = unit_m_ * readAs<float, std::uint32_t>(pixel, is_other_order_);
        pixel += sizeof(float);
      }
      return;
    }
    // The greatest number stands for everything beyond the sensor's reach; negative numbers are invalid.
    for (double& depth_m : depths_m) {
      const double number = readAs<std::uint16_t, std::uint16_t>(pixel, is_other_order_);
      const double beyond =
          number == greatest_ ? std::numeric_limits<double>::infinity() : -unit_m_;
      depth_m = number < greatest_ ? unit_m_ * number : beyond;
      pixel += sizeof(std::uint16_t);
    }
  }

 private:
  const Image& image_;
  double unit_m_;
  double greatest_;
  std::uint64_t step_;
  std::size_t pixel_bytes_;
  bool is_other_order_;
};

/// Whether a depth is that of a point.
bool isPoint(double depth_m) { return depth_m > 0.0 && depth_m <= kMaxReading_m; }

/// Replaces depths that stand for no return by NaN, and notes them. They may be numbers of units, such as 65534.
void findNamed(const CloudOptions& options, const DepthReader& reader,
               std::vector<double>& depths_m, std::vector<std::uint8_t>& are_named) {
  for (std::size_t column = 0; column < depths_m.size(); ++column) {
    double& depth_m = depths_m[column];
    const bool is_named =
        contains(options.no_return_ranges_m, depth_m) ||
        (reader.hasUnits() && contains(options.no_return_ranges_m, depth_m / reader.unit_m()));
    are_named[column] = is_named ? 1 : 0;
    if (is_named) depth_m = std::numeric_limits<double>::quiet_NaN();
  }
}

/// Depths of some rows that are those of points, in metres.
std::vector<double> sampleDepths(const Image& image, const DepthReader& reader) {
  constexpr std::size_t kSampledRows = 16;
  std::vector<double> depths_m(image.width);
  std::vector<double> sample_m;
  for (std::size_t row = 0; row < image.height; row += sampleStep(image.height, kSampledRows)) {
    reader.readRow(row, depths_m);
    std::copy_if(depths_m.begin(), depths_m.end(), std::back_inserter(sample_m), isPoint);
  }
  return sample_m;
}

/// Finds the unit of an image for which no unit is set, and sets it in the reader. @return Why it is refused.
std::optional<std::string> findUnit(const Image& image, DepthReader& reader,
                                    std::vector<std::string>& warnings) {
  constexpr double kLeastDepth_m = 0.05;  ///< Cameras hardly measure nearer, ...
  /// ... nor farther: beyond this, whole numbers are millimetres.
  constexpr double kMostDepth_m = 100.0;
  std::vector<double> depths_m = sampleDepths(image, reader);
  if (depths_m.empty()) return std::nullopt;
  const auto num_whole = std::count_if(depths_m.begin(), depths_m.end(), [](double depth_m) {
    return depth_m == std::floor(depth_m);
  });
  const double median_m = quantileOf(depths_m);
  if (reader.hasUnits()) {
    if (median_m >= kLeastDepth_m) return std::nullopt;
    return "as millimetres, half of its depths are at most " + cuboid_mapping::toText(median_m) +
           " m";
  }
  if (median_m > kMostDepth_m &&
      20 * num_whole >= 19 * std::distance(depths_m.begin(), depths_m.end())) {
    constexpr double kMillimetre_m = 1e-3;
    reader.setUnit(kMillimetre_m);
    warnings.push_back(
        "the depths of 32FC1 images are whole numbers, " + cuboid_mapping::toText(median_m) +
        " in the middle, and are taken as millimetres. If they are not, set length_unit");
    return std::nullopt;
  }
  if (median_m <= kMostDepth_m) return std::nullopt;
  return "as metres, half of its depths are at least " + cuboid_mapping::toText(median_m) + " m";
}

/// Converts the pixels of a checked image.
void addPixels(const Image& image, const DepthReader& reader, const Pinhole& pinhole,
               const CloudOptions& options, CloudPoints& cloud) {
  const bool has_ranges = !options.no_return_ranges_m.empty();
  const bool has_no_returns = options.no_return_range_m > 0.0 &&
                              (has_ranges || options.no_return_points != NoReturnPoints::kNone);
  std::vector<double> depths_m(image.width);
  std::vector<std::uint8_t> are_named(image.width, 0);
  std::vector<double> rights(image.width);
  for (std::size_t column = 0; column < image.width; ++column) {
    rights[column] = (static_cast<double>(column) - pinhole.cx) / pinhole.fx;
  }
  cloud.points.resize(std::size_t{image.width} * image.height);
  std::size_t num_points = 0;
  for (std::size_t row = 0; row < image.height; ++row) {
    reader.readRow(row, depths_m);
    if (has_ranges) findNamed(options, reader, depths_m, are_named);
    const double down = (static_cast<double>(row) - pinhole.cy) / pinhole.fy;
    const std::size_t first = num_points;
    // A reading that is no point is overwritten by the next, which needs no branch.
    for (std::size_t column = 0; column < image.width; ++column) {
      const double depth_m = depths_m[column];
      float* point = cloud.points[num_points].data();
      point[0] = static_cast<float>(depth_m * rights[column]);
      point[1] = static_cast<float>(depth_m * down);
      point[2] = static_cast<float>(depth_m);
      num_points += isPoint(depth_m) ? 1 : 0;
    }
    if (num_points - first == image.width || !has_no_returns) continue;
    for (std::size_t column = 0; column < image.width; ++column) {
      const double depth_m = depths_m[column];
      if (isPoint(depth_m)) continue;
      const bool is_wanted =
          are_named[column] != 0 || contains(options.no_return_points, classifyReading(depth_m));
      if (!is_wanted) continue;
      const Eigen::Vector3d ray(rights[column], down, 1.0);
      cloud.no_returns.emplace_back((options.no_return_range_m * ray.normalized()).cast<float>());
    }
  }
  cloud.num_invalid = cloud.points.size() - num_points;
  cloud.points.resize(num_points);
}

}  // namespace

bool hasFocalLength(const CameraInfo& camera) { return isUsable(makePinhole(camera)); }

ConvertedCloud convertDepthImage(const DepthImage& depth, const CloudOptions& options) {
  if (isCompressed(*depth.image)) {
    const auto image = decompress(*depth.image);
    if (const auto* error = std::get_if<std::string>(&image)) {
      return makeError(DropReason::kBadLayout, *depth.image, *error, "");
    }
    return convertDepthImage({std::get<Image::ConstPtr>(image), depth.camera}, options);
  }
  const Image& image = *depth.image;
  Pinhole pinhole = makePinhole(*depth.camera);
  if (auto error = checkImage(image, pinhole)) return *error;
  if (auto error = checkSize(image, *depth.camera)) return *error;
  CloudPoints cloud;
  const double unit_m = options.length_unit_m > 0.0 ? options.length_unit_m : usualUnit_m(image);
  const ByteOrder order = findByteOrder(image, unit_m);
  if (!order.warning.empty()) cloud.warnings.push_back(order.warning);
  if (hasNoCentre(*depth.camera)) {
    pinhole.cx = 0.5 * (image.width - 1.0);
    pinhole.cy = 0.5 * (image.height - 1.0);
    cloud.warnings.push_back(
        "camera_info has its principal point at 0, 0: the middle of the image is taken");
  }
  if (isDistorted(*depth.camera)) {
    cloud.warnings.push_back(
        "camera_info has distortion (" + depth.camera->distortion_model +
        "), which is not corrected: if this image is raw, map the rectified one (image_proc)");
  }
  if (pinhole.fx < 0.0 || pinhole.fy < 0.0) {
    cloud.warnings.push_back(
        "camera_info has a negative focal length: the points are mirrored, unless y of frame '" +
        image.header.frame_id + "' points up. Make it positive for optical frames");
  }
  DepthReader reader(image, unit_m, order.is_other);
  if (options.length_unit_m == 0.0) {
    if (const auto what = findUnit(image, reader, cloud.warnings)) {
      return makeError(DropReason::kWrongUnit, image, *what,
                       "Set length_unit to their unit in metres (millimetres: 0.001, metres: 1)");
    }
  }
  addPixels(image, reader, pinhole, options, cloud);
  cloud.num_skipped = cloud.num_invalid - cloud.no_returns.size();
  if (cloud.points.empty() && cloud.no_returns.empty()) {
    return makeError(DropReason::kNoValidPoints, image,
                     "all of its " + std::to_string(cloud.num_invalid) + " pixels have no depth");
  }
  return cloud;
}

}  // namespace cuboid_mapping_ros
