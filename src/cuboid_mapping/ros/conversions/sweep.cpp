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

/// Drops slices that are far from the others and have few points. @param counts  Points in each slice.
Slices dropStragglers(const Slices& slices, const std::vector<std::size_t>& counts,
                      std::size_t num_points) {
  constexpr std::int32_t kGap = 100;
  constexpr std::size_t kLeastPart = 100;
  Slices kept;
  std::size_t begin = 0;
  std::size_t num_of_group = 0;
  for (std::size_t i = 0; i < slices.size(); ++i) {
    num_of_group += counts[i];
    if (i + 1 < slices.size() && slices[i + 1] - slices[i] <= kGap) continue;
    if (num_of_group * kLeastPart >= num_points) {
      kept.insert(kept.end(), slices.begin() + static_cast<std::ptrdiff_t>(begin),
                  slices.begin() + static_cast<std::ptrdiff_t>(i + 1));
    }
    begin = i + 1;
    num_of_group = 0;
  }
  return kept;
}

}  // namespace

ros::Duration middleOf(std::int32_t slice) {
  ros::Duration middle;
  middle.fromNSec(slice * kSliceNanoseconds + kSliceNanoseconds / 2);
  return middle;
}

std::optional<Slices> findSlices(const std::vector<double>& times_s) {
  const std::int32_t limit = sliceOf(kMaxTime_s);
  std::vector<std::size_t> count_at(2 * static_cast<std::size_t>(limit) +
                                    1);  // Rounding may reach the limit.
  std::size_t num_good = 0;
  std::size_t num_odd = 0;
  for (const double time_s : times_s) {
    if (std::isnan(time_s)) continue;
    if (std::abs(time_s) < kMaxTime_s) {
      ++count_at.at(static_cast<std::size_t>(std::int64_t{sliceOf(time_s)} + limit));
      ++num_good;
    } else {
      ++num_odd;
    }
  }
  if (num_good == 0 || num_good < num_odd) return std::nullopt;
  Slices slices;
  std::vector<std::size_t> counts;
  for (std::size_t i = 0; i < count_at.size(); ++i) {
    if (count_at[i] == 0) continue;
    slices.push_back(static_cast<std::int32_t>(i) - limit);
    counts.push_back(count_at[i]);
  }
  return dropStragglers(slices, counts, num_good);
}

std::vector<CloudPoints> divideIntoSlices(const CloudPoints& cloud,
                                          const std::vector<double>& times_s,
                                          const Slices& slices) {
  std::vector<CloudPoints> parts(slices.size());
  for (CloudPoints& part : parts) part.anchor_cloud = cloud.anchor_cloud;
  const auto part_of = [&](std::uint32_t number) -> CloudPoints* {
    const double time_s = times_s.at(number);
    if (!(std::abs(time_s) < kMaxTime_s)) return nullptr;
    const auto slice = std::lower_bound(slices.begin(), slices.end(), sliceOf(time_s));
    if (slice == slices.end() || *slice != sliceOf(time_s)) return nullptr;
    return &parts.at(static_cast<std::size_t>(slice - slices.begin()));
  };
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    CloudPoints* part = part_of(cloud.point_numbers.at(i));
    if (part != nullptr) part->points.push_back(cloud.points[i]);
  }
  for (std::size_t i = 0; i < cloud.no_returns.size(); ++i) {
    CloudPoints* part = part_of(cloud.no_return_numbers.at(i));
    if (part != nullptr) part->no_returns.push_back(cloud.no_returns[i]);
  }
  return parts;
}

}  // namespace cuboid_mapping_ros
