// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/conversions/cloud_error.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <string>
#include <utility>

namespace cuboid_mapping_ros {

/// Durations of one stage of the work on a cloud.
class StageTime {
 public:
  void add(double duration_ms) {
    last_ms_ = duration_ms;
    max_ms_ = std::max(max_ms_, duration_ms);
    sum_ms_ += duration_ms;
    ++count_;
  }
  [[nodiscard]] double lastMs() const { return last_ms_; }
  [[nodiscard]] double maxMs() const { return max_ms_; }
  /// Mean in milliseconds; 0 before the first duration.
  [[nodiscard]] double meanMs() const {
    return count_ == 0 ? 0.0 : sum_ms_ / static_cast<double>(count_);
  }

 private:
  double last_ms_ = 0.0;
  double max_ms_ = 0.0;
  double sum_ms_ = 0.0;
  std::uint64_t count_ = 0;
};

/// Measures consecutive stages.
class Stopwatch {
 public:
  /// Milliseconds since the last call, or since construction.
  double lap() {
    const Clock::time_point now = Clock::now();
    const std::chrono::duration<double, std::milli> duration = now - std::exchange(start_, now);
    return duration.count();
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

/// Counts of points.
struct PointCounts {
  std::uint64_t num_points = 0;        ///< Points that took part, with beams without return.
  std::uint64_t num_invalid = 0;       ///< Points that are no returns, see CloudPoints.
  std::uint64_t num_odd_times = 0;     ///< With deskew: points with a time outside the sweep.
  std::uint64_t num_filtered = 0;      ///< Points too near, or outside the crop box.
  std::uint64_t num_on_robot = 0;      ///< Points left out by self_filter.
  std::uint64_t num_out_of_range = 0;  ///< Points outside the cells that a map can have.
  std::uint64_t num_too_far = 0;  ///< Points beyond kMaxBeamVoxels that max_range does not cut.
};

/// Figures of one cloud.
struct CloudFigures : PointCounts {
  double reach_m = 0.0;      ///< Range within which 95 % of its points lie, before any cut.
  double convert_ms = 0.0;   ///< From message to scan: conversion and filter.
  double ray_walk_ms = 0.0;  ///< From scan to voxels.
  double apply_ms = 0.0;     ///< From voxels to the map.
};

/// Counts of clouds since the start of the node, and of the points of those in the map. Not thread-safe.
struct NodeStatistics : PointCounts {
  std::uint64_t num_received = 0;
  std::uint64_t num_inserted = 0;
  std::array<std::uint64_t, kNumDropReasons> num_dropped{};  ///< By DropReason.
  double reach_m = 0.0;                                      ///< That of the last cloud.
  StageTime convert_time;                                    ///< See CloudFigures.
  StageTime ray_walk_time;
  StageTime apply_time;

  /// Counts a cloud in the map.
  void addInserted(const CloudFigures& cloud) {
    ++num_inserted;
    num_points += cloud.num_points;
    num_invalid += cloud.num_invalid;
    num_odd_times += cloud.num_odd_times;
    num_filtered += cloud.num_filtered;
    num_on_robot += cloud.num_on_robot;
    num_out_of_range += cloud.num_out_of_range;
    num_too_far += cloud.num_too_far;
    reach_m = cloud.reach_m;
    convert_time.add(cloud.convert_ms);
    ray_walk_time.add(cloud.ray_walk_ms);
    apply_time.add(cloud.apply_ms);
  }
  [[nodiscard]] std::uint64_t& numDropped(DropReason reason) {
    return num_dropped[static_cast<std::size_t>(reason)];
  }
  [[nodiscard]] std::uint64_t numDropped(DropReason reason) const {
    return num_dropped[static_cast<std::size_t>(reason)];
  }
  /// Number of clouds with nothing to map.
  [[nodiscard]] std::uint64_t numEmpty() const {
    return numDropped(DropReason::kNoPoints) + numDropped(DropReason::kNoValidPoints);
  }
  /// Number of dropped clouds, over all reasons, without empty ones.
  [[nodiscard]] std::uint64_t numDropped() const {
    return std::accumulate(num_dropped.begin(), num_dropped.end(), std::uint64_t{0}) - numEmpty();
  }
  /// Received clouds that wait for tf, or for their turn.
  [[nodiscard]] std::uint64_t numWaiting() const {
    return num_received - num_inserted - numDropped() - numEmpty();
  }
};

/// Texts about the last dropped clouds, by DropReason: what was wrong, and the cure; empty: nothing to say.
using LastDrops = std::array<std::string, kNumDropReasons>;

/// Whether clouds wait, as at the last report, and none has had its turn since.
/// @tparam StatisticsT  NodeStatistics, or SourceStatistics.
template <typename StatisticsT>
[[nodiscard]] bool isStuck(const StatisticsT& now, const StatisticsT& last_report) {
  return now.numWaiting() > 0 && last_report.numWaiting() > 0 &&
         now.num_received - now.numWaiting() == last_report.num_received - last_report.numWaiting();
}

}  // namespace cuboid_mapping_ros
