// SPDX-License-Identifier: BSD-3-Clause
// Messages measured while the sensor moved: the points of each millisecond have their own pose.
#pragma once

#include "cuboid_mapping/ros/conversions/cloud_conversions.h"
#include "cuboid_mapping/ros/conversions/sensor_conversions.h"
#include "cuboid_mapping/ros/mapping/tf_poses.h"

#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Slices in which points were measured, in order. Odd times are left out: those a second or more from the
/// stamp, and slices with less than a hundredth of the points that are 0.1 s away from all others.
/// @param times_s  Result of readPointTimes(); NaN is ignored. @return Nothing if more than half of the times are odd,
///                 there is none, or the sweep lies farther from the stamp than it is long, and than 0.1 s.
/// @complexity O(points).
[[nodiscard]] std::optional<Slices> findSlices(const std::vector<double>& times_s);

/// Points of each slice, in the order of the message; points of other times are left out.
/// @param cloud  Has the numbers of its points. @param times_s, slices  Times and slices of its message.
[[nodiscard]] std::vector<CloudPoints> divideIntoSlices(const CloudPoints& cloud,
                                                        const std::vector<double>& times_s,
                                                        const Slices& slices);

/// Times of the points of a message.
struct PointTimes {
  std::vector<double> times_s;  ///< After the stamp.
  std::string warning;          ///< Names a unit that is not the usual one; else empty.
};

/// Reads the times of the points of a message, in seconds after its stamp: for a cloud row by row, for a scan range by
/// range.
///
/// Cases:
///   - a cloud with a field `time` or `t` (Velodyne, Ouster), `offset_time` or `timestamp` (Livox),
///     `timestamp`, `time_stamp` or `timeStamp` (Hesai, RoboSense); the first one counts. Both byte orders;
///   - a scan: its time_increment times the number of the range;
///   - `unit_s` is the unit; if it is 0, whole numbers are nanoseconds, other ones seconds. If as such the sweep
///     takes less than a millisecond or most times are a second or more from the stamp, the unit of s, ms, us and ns
///     counts that makes a sweep of 5 ms or more of them;
///   - times up to a second count from the stamp, others are times of day;
///   - NaN: the time is invalid, or the point is no return and these are not wanted.
///
/// @return Nothing for a cloud without such a field, or with too little data; for a scan with
///         time_increment 0; for a depth image. @complexity O(points).
[[nodiscard]] std::optional<PointTimes> readPointTimes(const SensorMessage& message,
                                                       bool wants_no_returns = false,
                                                       double unit_s = 0.0);

}  // namespace cuboid_mapping_ros
