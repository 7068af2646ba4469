// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/clouds/source_report.h"

#include "cuboid_mapping/io/text.h"

namespace cuboid_mapping_ros {

using cuboid_mapping::counted;

ReportSummary summarize(const SourceReport& report, const SourceStatistics& last_report) {
  const SourceStatistics& now = report.statistics;
  const std::uint64_t num_dropped = now.num_dropped - last_report.num_dropped;
  if (num_dropped > 0) {
    return {ReportLevel::kWarning, counted(num_dropped, "message") + " dropped: " + now.last_drop};
  }
  if (!report.wrong_type.empty()) return {ReportLevel::kError, report.wrong_type};
  const bool has_ended = report.is_simulated_time && report.num_publishers == 0;
  if (report.silence_s > kMaxSilence_s && !has_ended) {
    return {ReportLevel::kWarning,
            "no " + report.type + " on " + report.topic +
                (now.num_received == 0
                     ? " yet"
                     : " for " + std::to_string(static_cast<int>(report.silence_s)) + " s") +
                (report.num_publishers == 0 ? ", nobody publishes it" : "") +
                ": check the topic and that the sensor is running"};
  }
  return {ReportLevel::kOk, counted(now.num_inserted, "message") + " in the map"};
}

void fillStatus(const SourceReport& report, const SourceStatistics& last_report,
                diagnostic_updater::DiagnosticStatusWrapper& status) {
  const ReportSummary summary = summarize(report, last_report);
  status.summary(static_cast<unsigned char>(summary.level), summary.message);
  status.add("topic", report.topic);
  status.add("type", report.type);
  status.add("messages received", report.statistics.num_received);
  status.add("messages inserted", report.statistics.num_inserted);
  status.add("messages dropped", report.statistics.num_dropped);
  status.add("messages ignored, max_rate", report.statistics.num_ignored);
  if (report.rate_hz) status.addf("rate [Hz]", "%.2f", *report.rate_hz);
}

}  // namespace cuboid_mapping_ros
