// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/diagnostics/cloud_ledger.h"

#include "cuboid_mapping/ros/diagnostics/diagnostics.h"
#include "cuboid_mapping/ros/middleware/names.h"

#include <ros/console.h>

namespace cuboid_mapping_ros {
namespace {

/// Minimum time before the log repeats a reason for dropping clouds, or an advice.
constexpr std::chrono::seconds kLogPeriod{10};

/// Whether a text may be logged again; if so, notes the time.
bool isDue(std::optional<CloudLedger::Clock::time_point>& last) {
  const auto now = CloudLedger::Clock::now();
  if (last && now - *last < kLogPeriod) return false;
  last = now;
  return true;
}

SpeedWatch makeSpeedWatch(const NodeParameters& parameters) {
  return SpeedWatch(parameters.map.resolution_m, parameters.source.max_range_m,
                    sourcesOf(parameters).size());
}

}  // namespace

CloudLedger::CloudLedger(const NodeParameters& parameters)
    : speed_watch_(makeSpeedWatch(parameters)) {
  for (const SourceParameters& source : sourcesOf(parameters)) {
    rate_limits_.emplace_back(source.max_rate_hz);
  }
  page_.sources.resize(rate_limits_.size());
  page_.last_received = page_.last_progress = Clock::now();
}

bool CloudLedger::noteReceived(std::size_t source, const std_msgs::Header& header) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Source& of = page_.sources.at(source);
  of.last_received = page_.last_received = Clock::now();
  if (!rate_limits_.at(source).lets(header.stamp)) {
    ++of.statistics.num_ignored;
    return false;
  }
  ++of.statistics.num_received;
  if (page_.statistics.num_received++ == 0) page_.last_progress = page_.last_received;
  page_.last_source = source;
  page_.last_arrival = ros::Time::now();
  page_.last_header = header;
  speed_watch_.noteReceived(header.stamp.toSec(), source);
  return true;
}

void CloudLedger::noteInserted(std::size_t source, const NodeStatistics& work, double duration_s) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++page_.sources.at(source).statistics.num_inserted;
  page_.last_progress = Clock::now();
  page_.statistics.takeWork(work);
  ++page_.statistics.num_inserted;
  speed_watch_.noteInserted(duration_s, work.reach_m, source);
}

void CloudLedger::noteDropped(std::size_t source, DropReason reason,
                              const std::string& text) noexcept {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++page_.statistics.numDropped(reason);
  SourceStatistics& statistics = page_.sources.at(source).statistics;
  ++statistics.num_dropped;
  try {
    statistics.last_drop = std::string(toString(reason)) + ": " + toAdvice(reason);
    if (text.empty() || !isDue(last_logged_[static_cast<std::size_t>(reason)])) return;
    std::string why = text;
    if (reason == DropReason::kQueueFull) why = speed_watch_.advice().value_or(text);
    ROS_WARN_STREAM_NAMED(kNodeName, "cloud dropped, " << toString(reason) << ": " << why << " ("
                                                       << page_.statistics.numDropped(reason)
                                                       << " for this reason so far)");
  } catch (...) {
    // There is no memory for the text; the drop is counted.
  }
}

void CloudLedger::giveAdvice(bool is_behind) {
  const std::lock_guard<std::mutex> lock(mutex_);
  is_behind_ = is_behind;
  if (!has_suggested_) {
    if (const auto suggestion = speed_watch_.suggestion()) {
      has_suggested_ = true;
      ROS_INFO_STREAM_NAMED(kNodeName, *suggestion);
    }
  }
  if (!is_behind) return;
  const auto advice = speed_watch_.advice();
  if (!advice || !isDue(last_advice_)) return;
  ROS_WARN_STREAM_NAMED(kNodeName, "too slow for these clouds: " << *advice);
}

void CloudLedger::setParameters(const NodeParameters& parameters) {
  const std::lock_guard<std::mutex> lock(mutex_);
  speed_watch_ = makeSpeedWatch(parameters);
  const std::vector<SourceParameters> sources = sourcesOf(parameters);
  for (std::size_t i = 0; i < rate_limits_.size(); ++i) {
    rate_limits_[i] = RateLimit(sources.at(i).max_rate_hz);
  }
}

CloudLedger::Page CloudLedger::page() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  Page page = page_;
  for (std::size_t i = 0; i < page.sources.size(); ++i) {
    page.sources[i].rate_hz = speed_watch_.rateHz(i);
  }
  if (is_behind_) page.speed_advice = speed_watch_.advice();
  return page;
}

}  // namespace cuboid_mapping_ros
