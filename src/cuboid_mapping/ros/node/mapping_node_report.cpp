// SPDX-License-Identifier: BSD-3-Clause
// The report of a MappingNode in /diagnostics.
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"
#include "cuboid_mapping/ros/node/mapping_node.h"

#include <ros/console.h>

#include <chrono>
#include <mutex>

namespace cuboid_mapping_ros {

LastCloud MappingNode::describeLastCloud(const CloudLedger::Figures& figures) {
  LastCloud cloud;
  cloud.frame_id = figures.last_header.frame_id;
  cloud.has_stamp = !figures.last_header.stamp.isZero();
  // ros::Duration would throw beyond 2^31 s.
  cloud.age_s = figures.last_arrival.toSec() - figures.last_header.stamp.toSec();
  const std::lock_guard<std::mutex> lock(frames_mutex_);
  const PoseSearch search =
      findPoses(tf_buffer_, frames_.at(figures.last_source), figures.last_header, {});
  cloud.tf_error = search.why;
  cloud.tf_lead_s = search.lead_s;
  return cloud;
}

void MappingNode::warnOfSilence(const NodeReport& report) {
  const bool has_no_cloud = report.statistics.num_received == 0 && report.num_publishers == 0 &&
                            report.silence_s > kMaxSilence_s;
  if (has_warned_of_silence_ || !has_no_cloud || !report.wrong_types.empty()) return;
  has_warned_of_silence_ = true;
  ROS_WARN_STREAM_NAMED(kNodeName, summarize(report, reported_statistics_).message);
}

void MappingNode::reportDiagnostics(diagnostic_updater::DiagnosticStatusWrapper& status) {
  const auto seconds_since = [](Clock::time_point time) {
    return std::chrono::duration<double>(Clock::now() - time).count();
  };
  NodeReport report;
  const CloudLedger::Figures figures = ledger_.figures();
  report.statistics = figures.statistics;
  report.map = map_.read([this](const CuboidMap& map) { return map_watch_.summarize(map); });
  report.cloud_topic = sources_.topics();
  report.frame_id = withoutSlash(parameters_.frame_id);
  if (figures.statistics.num_received > 0) report.last_cloud = describeLastCloud(figures);
  report.num_publishers = sources_.numPublishers();
  for (const auto& feature : features_) feature->report(report);
  report.is_simulated_time = ros::Time::isSimTime();
  report.is_paused = is_paused_;
  if (parameters_.fleet.robots.empty()) {
    report.wrong_types = sources_.findWrongTypes();
    report.other_topics = sources_.otherTopics();
  }
  report.silence_s = seconds_since(figures.last_received);
  if (report.is_simulated_time && report.num_publishers > 0) {
    report.silence_s =
        ros::Time::now().toSec() - figures.last_arrival.toSec();  // a bag may be paused
  }
  report.why_waiting = clouds_.whyWaiting();
  report.lag_s = figures.lag_s;
  report.starved_s = seconds_since(figures.last_progress);
  for (std::size_t i = 0; i < figures.sources.size(); ++i) {
    const std::string name = figures.sources.size() == 1 ? "" : nameOf(sources_.at(i));
    if (figures.sources[i].rate_hz) report.rates.push_back({name, *figures.sources[i].rate_hz});
  }
  report.speed_advice = figures.speed_advice;
  report.num_failures = guard_.numFailures();
  report.num_new_failures = report.num_failures - num_reported_failures_;
  report.last_failure = guard_.lastFailure();
  num_reported_failures_ = report.num_failures;
  warnOfSilence(report);
  fillStatus(report, reported_statistics_, status);
  reported_statistics_ = figures.statistics;
}

}  // namespace cuboid_mapping_ros
