// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/diagnostics/node_statistics.h"

#include <algorithm>
#include <numeric>

namespace cuboid_mapping_ros {

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
