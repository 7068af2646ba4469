// SPDX-License-Identifier: BSD-3-Clause
// Messages measured while the sensor moved: the points of each millisecond have their own pose.
#pragma once

#include "cuboid_mapping/ros/conversions/cloud_conversions.h"

#include <ros/duration.h>

#include <cstdint>
#include <optional>
#include <vector>

namespace cuboid_mapping_ros {

/// Slices of a sweep by number: slice i has the points from i to i + 1 milliseconds after the stamp.
using Slices = std::vector<std::int32_t>;

/// Middle of a slice, after the stamp.
[[nodiscard]] ros::Duration middleOf(std::int32_t slice);

/// Slices in which points were measured, in order. Odd times are left out: those a second or more from the stamp, and
/// slices with less than a hundredth of the points that are 0.1 s away from all others.
/// @param times_s  Result of readPointTimes(); NaN is ignored. @return Nothing if more than half of the times are
///                 odd, or there is none. @complexity O(points).
[[nodiscard]] std::optional<Slices> findSlices(const std::vector<double>& times_s);

/// Points of each slice, in the order of the message; points of other times are left out.
/// @param cloud  Has the numbers of its points. @param times_s, slices  Times and slices of its message.
[[nodiscard]] std::vector<CloudPoints> divideIntoSlices(const CloudPoints& cloud,
                                                        const std::vector<double>& times_s,
                                                        const Slices& slices);

}  // namespace cuboid_mapping_ros
