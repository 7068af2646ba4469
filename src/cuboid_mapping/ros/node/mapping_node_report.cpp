// SPDX-License-Identifier: BSD-3-Clause
// What a MappingNode says of itself in /diagnostics.
#include "cuboid_mapping/ros/middleware/tf_lookup.h"
#include "cuboid_mapping/ros/node/mapping_node.h"

#include <chrono>

namespace cuboid_mapping_ros {

LastCloud MappingNode::describeLastCloud() const {
  LastCloud cloud;
  cloud.frame_id = last_header_.frame_id;
  // Not by ros::Duration, which throws beyond 2^31 s.
  cloud.age_s = last_arrival_.toSec() - last_header_.stamp.toSec();
  // NOLINTNEXTLINE(bugprone-unused-return-value): only the reason for no pose is wanted.
  (void)lookupPoses(tf_buffer_, sources_.at(last_source_).parameters, last_header_, cloud.tf_error);
  return cloud;
}

void MappingNode::reportDiagnostics(diagnostic_updater::DiagnosticStatusWrapper& status) {
  const auto seconds_since = [](Clock::time_point time) {
    return std::chrono::duration<double>(Clock::now() - time).count();
  };
  NodeReport report;
  report.statistics = statistics_;
  report.map = map_.read([this](const cuboid_mapping::CuboidMap& map, const ros::Time& /*stamp*/) {
    return map_watch_.summarize(map);
  });
  report.window = map_.windowFigures();
  if (report.window) {
    report.num_new_window_failures = report.window->num_failures - num_reported_window_failures_;
    num_reported_window_failures_ = report.window->num_failures;
  }
  report.cloud_topic = merger_ ? merger_->topics() : sources_.topics();
  report.frame_id = withoutSlash(parameters_.frame_id);
  if (statistics_.num_received > 0) report.last_cloud = describeLastCloud();
  report.is_simulated_time = ros::Time::isSimTime();
  report.is_paused = edit_services_->isPaused();
  report.num_publishers = merger_ ? merger_->numPublishers() : sources_.numPublishers();
  report.silence_s = seconds_since(last_received_);
  if (report.is_simulated_time && report.num_publishers > 0) {
    report.silence_s = ros::Time::now().toSec() - last_arrival_.toSec();  // a bag may be paused
  }
  report.num_out_of_order = cloud_intake_.numOutOfOrder();
  report.why_waiting = cloud_intake_.whyItWaits();
  report.starved_s = seconds_since(last_progress_);
  report.num_built = octomap_server_.numBuilt();
  report.rate_hz = speed_watch_.rateHz();
  report.speed_advice = speed_watch_.advice();
  report.autosave_error = map_files_->autosaveError();
  report.num_failures = guard_.numFailures();
  report.num_new_failures = report.num_failures - num_reported_failures_;
  report.last_failure = guard_.lastFailure();
  num_reported_failures_ = report.num_failures;
  fillStatus(report, reported_statistics_, status);
  reported_statistics_ = statistics_;
}

}  // namespace cuboid_mapping_ros
