// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/conversions/sensor_message.h"

#include <optional>
#include <vector>

namespace cuboid_mapping_ros {

/// Times of the points of a message, in seconds after its stamp: for a cloud row by row, for a scan range by
/// range.
///
/// Cases:
///   - a cloud with a field `time` or `t` (Velodyne, Ouster), `offset_time` or `timestamp` (Livox),
///     `timestamp`, `time_stamp` or `timeStamp` (Hesai, RoboSense); the first one counts. Whole numbers are nanoseconds;
///     floating-point numbers are seconds, or beyond 1e15 nanoseconds. Values beyond 1e6 s are times of day, others count
///     from the stamp. Both byte orders;
///   - a scan: its time_increment times the number of the range;
///   - NaN: the time is invalid, or the point is no return and these are not wanted.
///
/// @return Nothing for a cloud without such a field, or with too little data; for a scan with
///         time_increment 0; for a depth image. @complexity O(points).
[[nodiscard]] std::optional<std::vector<double>> readPointTimes(const SensorMessage& message,
                                                                bool wants_no_returns = false);

}  // namespace cuboid_mapping_ros
