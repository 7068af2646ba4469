// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/conversions/cloud_conversions.h"

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>

namespace cuboid_mapping_ros {

/// Why a cloud did not get into the map.
enum class DropReason : unsigned char {
  // As CloudDefect, in the same order.
  kEmptyFrame,
  kNoPoints,
  kNoXyzFields,
  kWrongDatatype,
  kBadLayout,
  kShortData,
  kNoValidPoints,
  kNoPointTimes,
  kQueueFull,     ///< The node was busy with the clouds before it.
  kNoTransform,   ///< tf did not come within tf_wait, or before the memory was full.
  kTooOldForTf,   ///< Older than the transforms that tf keeps.
  kNoCameraInfo,  ///< A depth image.
  kPaused,        ///< By ~pause.
  kBeforeJump,    ///< Older than the jump of which ~move_map was told.
  kInternalError  ///< An exception, as when there is no memory.
};

/// Number of enumerators of DropReason.
constexpr std::size_t kNumDropReasons = 15;

/// The reason to drop a cloud with a defect.
[[nodiscard]] DropReason toDropReason(CloudDefect defect);

/// A short name for diagnostics, as "no transform".
[[nodiscard]] const char* toString(DropReason reason);

/// Durations of one stage of the work on a cloud.
class StageTime {
 public:
  void add(double duration_ms);
  [[nodiscard]] double lastMs() const { return last_ms_; }
  [[nodiscard]] double maxMs() const { return max_ms_; }
  /// 0 before the first.
  [[nodiscard]] double meanMs() const;

 private:
  double last_ms_ = 0.0;
  double max_ms_ = 0.0;
  double sum_ms_ = 0.0;
  std::uint64_t count_ = 0;
};

/// Measures stages that follow each other.
class Stopwatch {
 public:
  /// Milliseconds since the last call, or since construction.
  double lap();

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

/// Counts of clouds since the start of the node. Not thread-safe.
struct NodeStatistics {
  std::uint64_t num_received = 0;
  std::uint64_t num_inserted = 0;
  std::array<std::uint64_t, kNumDropReasons> num_dropped{};  ///< By DropReason.

  // Points of inserted clouds.
  std::uint64_t num_points = 0;        ///< That took part, beams without return included.
  std::uint64_t num_invalid = 0;       ///< No returns, see CloudPoints.
  std::uint64_t num_odd_times = 0;     ///< With deskew: measured at no time of the sweep.
  std::uint64_t num_filtered = 0;      ///< Too near, or outside the crop box.
  std::uint64_t num_on_robot = 0;      ///< Left out by self_filter.
  std::uint64_t num_out_of_range = 0;  ///< Outside the cells that a map can have.
  double reach_m =
      0.0;  ///< Range within which 95 % of the last cloud's points lie, before any cut.
  std::uint64_t num_too_far = 0;  ///< Beyond kMaxBeamVoxels, and not cut by max_range.

  StageTime convert_time;   ///< Message to scan: conversion and filter.
  StageTime ray_walk_time;  ///< Scan to voxels.
  StageTime apply_time;     ///< Voxels into the map.

  [[nodiscard]] std::uint64_t& numDropped(DropReason reason) {
    return num_dropped[static_cast<std::size_t>(reason)];
  }
  [[nodiscard]] std::uint64_t numDropped(DropReason reason) const {
    return num_dropped[static_cast<std::size_t>(reason)];
  }
  /// Takes the figures of points and times from others; the counts of clouds stay.
  void takeWork(const NodeStatistics& work);
  /// Sum over all reasons.
  [[nodiscard]] std::uint64_t numDropped() const;
  /// Clouds that were received and wait for tf, or for their turn.
  [[nodiscard]] std::uint64_t numWaiting() const;
};

}  // namespace cuboid_mapping_ros
