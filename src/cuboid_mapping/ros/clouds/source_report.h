// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/diagnostics/cloud_ledger.h"
#include "cuboid_mapping/ros/diagnostics/diagnostics.h"

#include <cstddef>
#include <optional>
#include <string>

namespace cuboid_mapping_ros {

/// Everything that one report on a source is about.
struct SourceReport {
  SourceStatistics statistics;
  std::optional<double> rate_hz;
  std::string topic;  ///< As it is after remapping.
  std::string type;
  std::size_t num_publishers = 0;
  std::string wrong_type;          ///< See describeWrongType(); only where nothing has come yet.
  double silence_s = 0.0;          ///< Since its last message, or the start of the node.
  bool is_simulated_time = false;  ///< use_sim_time, as with bags.
};

/// The first of these that applies:
///   - messages were dropped since the last report: warning with the reason;
///   - the topic is published with another type: error;
///   - none has come for kMaxSilence_s, unless with simulated time and no publisher any more: warning;
///   - else: all is well.
[[nodiscard]] ReportSummary summarize(const SourceReport& report,
                                      const SourceStatistics& last_report);

/// Writes a report; one key for each figure.
void fillStatus(const SourceReport& report, const SourceStatistics& last_report,
                diagnostic_updater::DiagnosticStatusWrapper& status);

}  // namespace cuboid_mapping_ros
