// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/node/node_diagnostics.h"

#include "cuboid_mapping/ros/mapping/cloud_queue.h"
#include "cuboid_mapping/ros/middleware/names.h"

#include <ros/console.h>
#include <ros/time.h>

#include <algorithm>
#include <utility>

namespace cuboid_mapping_ros {

NodeDiagnostics::NodeDiagnostics(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh,
                                 const CallbackGuard& guard, const CloudLedger& ledger,
                                 const GuardedMap& map, AddTo add_others)
    : guard_(guard),
      ledger_(ledger),
      map_(map),
      add_others_(std::move(add_others)),
      map_watch_(steadySeconds),
      updater_(nh, private_nh, private_nh.getNamespace()) {
  updater_.setHardwareID("none");
  updater_.add("mapping", this, &NodeDiagnostics::report);
}

void NodeDiagnostics::start(const ros::NodeHandle& nh) {
  timer_ = Timer(nh, std::max(0.1, updater_.getPeriod()), [this] { updater_.force_update(); });
}

NodeReport NodeDiagnostics::makeReport(const CloudLedger::Figures& figures) {
  NodeReport report;
  report.statistics = figures.statistics;
  report.lag_s = figures.lag_s;
  report.starved_s = secondsSince(figures.last_progress);
  report.speed_advice = figures.speed_advice;
  report.map = map_.readWhole([this](const CuboidMap& map) { return map_watch_.summarize(map); });
  report.is_simulated_time = ros::Time::isSimTime();
  report.num_failures = guard_.numFailures();
  report.num_new_failures = report.num_failures - num_failures_;
  report.last_failure = guard_.lastFailure();
  add_others_(figures, report);
  return report;
}

void NodeDiagnostics::report(diagnostic_updater::DiagnosticStatusWrapper& status) {
  const CloudLedger::Figures figures = ledger_.figures();
  const NodeReport report = makeReport(figures);
  num_failures_ = report.num_failures;
  warnOfSilence(report);
  fillStatus(report, statistics_, status);
  statistics_ = figures.statistics;
}

void NodeDiagnostics::warnOfSilence(const NodeReport& report) {
  const bool has_no_cloud = report.statistics.num_received == 0 && report.num_publishers == 0 &&
                            report.silence_s > kMaxSilence_s;
  if (has_warned_of_silence_ || !has_no_cloud || !report.wrong_types.empty()) return;
  has_warned_of_silence_ = true;
  ROS_WARN_STREAM_NAMED(kNodeName, summarize(report, statistics_).message);
}

}  // namespace cuboid_mapping_ros
