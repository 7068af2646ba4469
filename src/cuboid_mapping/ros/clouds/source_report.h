// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/diagnostics/cloud_ledger.h"
#include "cuboid_mapping/ros/diagnostics/diagnostics.h"

#include <cstddef>
#include <optional>
#include <string>

namespace cuboid_mapping_ros {

/// Content of one report on a source.
struct SourceReport {
  SourceStatistics statistics;
  std::optional<double> rate_hz;
  std::string topic;  ///< Topic after remapping.
  std::string type;
  std::size_t num_publishers = 0;
  std::string wrong_type;          ///< See describeWrongType(); set only before the first message.
  double silence_s = 0.0;          ///< Time since its last message, or since the start of the node.
  bool is_simulated_time = false;  ///< use_sim_time, as with bags.
};

/// The first case that applies:
///   - messages were dropped since the last report: warning with the reason;
///   - the topic is published with another type: error;
///   - no message for kMaxSilence_s, unless time is simulated and the publisher has gone: warning;
///   - else: all is well.
[[nodiscard]] ReportSummary summarize(const SourceReport& report,
                                      const SourceStatistics& last_report);

/// Writes a report with one key for each figure.
void fillStatus(const SourceReport& report, const SourceStatistics& last_report,
                diagnostic_updater::DiagnosticStatusWrapper& status);

}  // namespace cuboid_mapping_ros
