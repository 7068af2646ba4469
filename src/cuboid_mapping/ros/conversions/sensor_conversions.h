// SPDX-License-Identifier: BSD-3-Clause
// From the message of any source to points in its frame: a type of source is a function here, and an
// alternative of SensorMessage.
#pragma once

#include "cuboid_mapping/ros/conversions/cloud_conversions.h"
#include "cuboid_mapping/ros/conversions/sensor_message.h"

#include <sensor_msgs/LaserScan.h>

#include <variant>

namespace cuboid_mapping_ros {

/// Takes the points out of a planar scan, in its frame, where laser_geometry puts them.
///
/// A range of at least range_min and below range_max is a return. NaN, +inf, -inf, 0, what is beyond range_max, and
/// the named ranges are what `no_return_points` says: beams without return of known direction, or nothing.
/// Any other range is to be discarded, as sensor_msgs/LaserScan says.
///
/// @param options  T_cloud_sensor is not looked at: the beams start in the scan's frame.
/// @return At least one point or no-return; or why the message is refused. @complexity O(ranges).
[[nodiscard]] std::variant<CloudPoints, CloudError> convertLaserScan(
    const sensor_msgs::LaserScan& scan, const CloudOptions& options = {});

/// Takes the points out of a depth image, in its frame: x right, y down, z forward (REP 103).
///
/// Cases:
///   - encoding 16UC1, 16SC1 or mono16: units of `depth_unit_m`, 0 is no measurement, and the greatest number is +inf;
///     32FC1: metres (REP 118). Both byte orders. A step that is none is replaced where the rows have no gaps;
///   - compressed images of toCompressedImage() are decompressed first;
///   - an image of another size than the camera's is refused;
///   - the camera's projection matrix counts, or its intrinsics where there is none. Region of interest and
///     binning are taken into account; distortion is not: depth images are rectified;
///   - NaN, +inf, -inf, 0 and the named depths, in metres or units, are what `no_return_points` says, as for a planar
///     scan; negative depths are discarded. A beam without return reaches `no_return_range_m` along its own direction.
///
/// @param options  As of convertLaserScan().
/// @return At least one point or no-return; or why the message is refused. @complexity O(pixels).
[[nodiscard]] std::variant<CloudPoints, CloudError> convertDepthImage(
    const DepthImage& depth, const CloudOptions& options = {});

/// convertCloud(), convertLaserScan() or convertDepthImage().
[[nodiscard]] std::variant<CloudPoints, CloudError> convert(const SensorMessage& message,
                                                            const CloudOptions& options = {});

}  // namespace cuboid_mapping_ros
