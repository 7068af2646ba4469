// SPDX-License-Identifier: BSD-3-Clause
// Messages that were measured while the sensor moved: the points of each thousandth of a second have a pose of their own.
#pragma once

#include "cuboid_mapping/ros/conversions/cloud_conversions.h"

#include <ros/duration.h>

#include <cstdint>
#include <optional>
#include <vector>

namespace cuboid_mapping_ros {

/// Slices of a sweep by their numbers: slice i has the points from i to i + 1 thousandths of a second after the stamp.
using Slices = std::vector<std::int32_t>;

/// The middle of a slice, after the stamp.
[[nodiscard]] ros::Duration middleOf(std::int32_t slice);

/// The slices in which points were measured, in order; not those of odd times, which are a second or more from the
/// stamp, or of less than a hundredth of the points and 0.1 s away from all others.
/// @param times_s  Of readPointTimes(); NaN counts for nothing. @return Nothing when more than half of the times are
///                 odd, or there is none. @complexity O(points).
[[nodiscard]] std::optional<Slices> findSlices(const std::vector<double>& times_s);

/// The points of each slice, in the order of the message; those of other times are left out.
/// @param cloud  With the numbers of its points. @param times_s, slices  Of its message.
[[nodiscard]] std::vector<CloudPoints> divideIntoSlices(const CloudPoints& cloud,
                                                        const std::vector<double>& times_s,
                                                        const Slices& slices);

}  // namespace cuboid_mapping_ros
