// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/diagnostics/node_statistics.h"

#include <algorithm>
#include <numeric>

namespace cuboid_mapping_ros {

static_assert(static_cast<int>(DropReason::kEmptyFrame) ==
              static_cast<int>(CloudDefect::kEmptyFrame));
static_assert(static_cast<int>(DropReason::kNoPointTimes) ==
              static_cast<int>(CloudDefect::kNoPointTimes));
static_assert(static_cast<std::size_t>(DropReason::kQueueFull) == kNumCloudDefects);
static_assert(static_cast<std::size_t>(DropReason::kInternalError) + 1 == kNumDropReasons);

DropReason toDropReason(CloudDefect defect) { return static_cast<DropReason>(defect); }

const char* toString(DropReason reason) {
  switch (reason) {
    case DropReason::kQueueFull: return "queue full";
    case DropReason::kNoTransform: return "no transform";
    case DropReason::kTooOldForTf: return "too old for tf";
    case DropReason::kNoCameraInfo: return "no camera_info";
    case DropReason::kPaused: return "paused";
    case DropReason::kBeforeJump: return "before a jump";
    case DropReason::kInternalError: return "internal error";
    default: return toString(static_cast<CloudDefect>(reason));
  }
}

void StageTime::add(double duration_ms) {
  last_ms_ = duration_ms;
  max_ms_ = std::max(max_ms_, duration_ms);
  sum_ms_ += duration_ms;
  ++count_;
}

double StageTime::meanMs() const {
  return count_ == 0 ? 0.0 : sum_ms_ / static_cast<double>(count_);
}

double Stopwatch::lap() {
  const Clock::time_point now = Clock::now();
  const std::chrono::duration<double, std::milli> duration = now - start_;
  start_ = now;
  return duration.count();
}

void NodeStatistics::takeWork(const NodeStatistics& work) {
  NodeStatistics taken = work;
  taken.num_received = num_received;
  taken.num_inserted = num_inserted;
  taken.num_dropped = num_dropped;
  *this = taken;
}

std::uint64_t NodeStatistics::numDropped() const {
  return std::accumulate(num_dropped.begin(), num_dropped.end(), std::uint64_t{0});
}

std::uint64_t NodeStatistics::numWaiting() const {
  return num_received - num_inserted - numDropped();
}

}  // namespace cuboid_mapping_ros
