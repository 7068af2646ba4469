// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/conversions/sweep.h"

#include <algorithm>
#include <cmath>

namespace cuboid_mapping_ros {
namespace {

constexpr std::int64_t kSliceNanoseconds = 1000000;
constexpr double kMaxTime_s = 1.0;

std::int32_t sliceOf(double time_s) {
  return static_cast<std::int32_t>(
      std::floor(1e9 * time_s / static_cast<double>(kSliceNanoseconds)));
}

}  // namespace

ros::Duration middleOf(std::int32_t slice) {
  ros::Duration middle;
  middle.fromNSec(slice * kSliceNanoseconds + kSliceNanoseconds / 2);
  return middle;
}

std::optional<Slices> findSlices(const std::vector<double>& times_s) {
  const std::int32_t limit = sliceOf(kMaxTime_s);
  std::vector<bool> has_points(2 * static_cast<std::size_t>(limit) +
                               1);  // Rounding may reach the limit.
  for (const double time_s : times_s) {
    if (!(std::abs(time_s) < kMaxTime_s)) return std::nullopt;
    has_points.at(static_cast<std::size_t>(std::int64_t{sliceOf(time_s)} + limit)) = true;
  }
  Slices slices;
  for (std::size_t i = 0; i < has_points.size(); ++i) {
    if (has_points[i]) slices.push_back(static_cast<std::int32_t>(i) - limit);
  }
  return slices;
}

std::vector<CloudPoints> divideIntoSlices(const CloudPoints& cloud,
                                          const std::vector<double>& times_s,
                                          const Slices& slices) {
  std::vector<CloudPoints> parts(slices.size());
  for (CloudPoints& part : parts) part.anchor_cloud = cloud.anchor_cloud;
  const auto part_of = [&](std::uint32_t number) -> CloudPoints& {
    const auto slice = std::lower_bound(slices.begin(), slices.end(), sliceOf(times_s.at(number)));
    return parts.at(static_cast<std::size_t>(slice - slices.begin()));
  };
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    part_of(cloud.point_numbers.at(i)).points.push_back(cloud.points[i]);
  }
  for (std::size_t i = 0; i < cloud.no_returns.size(); ++i) {
    part_of(cloud.no_return_numbers.at(i)).no_returns.push_back(cloud.no_returns[i]);
  }
  return parts;
}

}  // namespace cuboid_mapping_ros
