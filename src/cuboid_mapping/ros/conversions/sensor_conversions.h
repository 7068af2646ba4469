// SPDX-License-Identifier: BSD-3-Clause
// Converts messages of all sources to points in their frames: a type of source is a function here, and an
// alternative of SensorMessage.
#pragma once

#include "cuboid_mapping/ros/conversions/cloud_conversions.h"

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

/// Converts a planar scan to points in its frame, where laser_geometry puts them.
///
/// An angle_increment by which the scan would go round more than twice, or not turn at all, is replaced.
///
/// A range of at least range_min and below range_max is a return. NaN, +inf, -inf, 0, ranges beyond range_max,
/// and the given ranges depend on `no_return_points`: beams without return of known direction, or nothing. Any
/// other range is discarded, as sensor_msgs/LaserScan says. With `length_unit_m`, limits below 1000 are in metres, other
/// ones in that unit.
///
/// @param options  T_cloud_sensor is ignored: the beams start in the scan's frame.
/// @return At least one point or no-return; or the reason of refusal. @complexity O(ranges).
[[nodiscard]] ConvertedCloud convertLaserScan(const sensor_msgs::LaserScan& scan,
                                              const CloudOptions& options = {});

/// The maximum range of a scan; infinity if it is not above range_min: then its driver has left it unset.
[[nodiscard]] float rangeMaxOf(const sensor_msgs::LaserScan& scan);

/// Whether a camera_info has a focal length: an uncalibrated camera has none.
[[nodiscard]] bool hasFocalLength(const sensor_msgs::CameraInfo& camera);

/// Converts a depth image to points in its frame: x right, y down, z forward (REP 103).
///
/// Cases:
///   - encoding 16UC1, 16SC1 or mono16: 0 is no measurement, and the greatest number is +inf; 32FC1. Both byte
///     orders, see findByteOrder(). An impossible step is replaced if rows have no gaps; larger pixels are refused;
///   - `length_unit_m` is the unit; if it is 0, whole numbers count millimetres, and 32FC1 metres (REP 118), or
///     millimetres if 19 of 20 depths are whole numbers, and half are above 100. Depths that no camera measures in that
///     unit are refused;
///   - compressed images of toCompressedImage() are decompressed first;
///   - an image of another size than the camera's is refused;
///   - the camera's projection matrix counts, or else its intrinsics. Region of interest and
///     binning are taken into account; distortion is not, which is a warning: depth images are rectified;
///   - NaN, +inf, -inf, 0 and the given depths, in metres or units, depend on `no_return_points`, as for a
///     planar scan; negative depths are discarded. A beam without return reaches `no_return_range_m` along its
///     own direction.
///
/// @param options  As for convertLaserScan().
/// @return At least one point or no-return; or the reason of refusal. @complexity O(pixels).
[[nodiscard]] ConvertedCloud convertDepthImage(const DepthImage& depth,
                                               const CloudOptions& options = {});

/// convertCloud(), convertLaserScan() or convertDepthImage().
[[nodiscard]] ConvertedCloud convert(const SensorMessage& message,
                                     const CloudOptions& options = {});

}  // namespace cuboid_mapping_ros
