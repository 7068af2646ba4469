// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/conversions/sensor_message.h"

#include <optional>
#include <vector>

namespace cuboid_mapping_ros {

/// When each point of a message was measured, in seconds after its stamp: of a cloud row by row, of a scan range by
/// range.
///
/// Cases:
///   - a cloud has the first of these fields: `time` or `t` (Velodyne, Ouster), `offset_time` or `timestamp` (Livox),
///     `timestamp`, `time_stamp` or `timeStamp` (Hesai, RoboSense). Whole numbers are nanoseconds; floating-point
///     numbers are seconds, those beyond 1e15 nanoseconds. What is beyond 1e6 s is a time of day, else it counts
///     from the stamp. Both byte orders;
///   - a scan: its time_increment times the number of the range;
///   - NaN: the time is none, or the point is no return and those are not wanted.
///
/// @return Nothing for a cloud without such a field, or with less data than it says; for a scan with
///         time_increment 0; for a depth image. @complexity O(points).
[[nodiscard]] std::optional<std::vector<double>> readPointTimes(const SensorMessage& message,
                                                                bool wants_no_returns = false);

}  // namespace cuboid_mapping_ros
