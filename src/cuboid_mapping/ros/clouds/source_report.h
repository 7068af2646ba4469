// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/diagnostics/diagnostics.h"

#include <cstdint>
#include <string>

namespace cuboid_mapping_ros {

/// What has happened to the messages of one source since the node was started.
struct SourceStatistics {
  std::uint64_t num_received = 0;  ///< Those beyond max_rate are not counted here ...
  std::uint64_t num_ignored = 0;   ///< ... but here.
  std::uint64_t num_inserted = 0;
  std::uint64_t num_dropped = 0;
  std::uint64_t num_without_camera = 0;  ///< Depth images without camera_info; not received.
  std::string last_drop;                 ///< Why the last one was dropped; empty: none was.
};

/// Everything that one report on a source is about.
struct SourceReport {
  SourceStatistics statistics;
  std::string topic;  ///< As it is after remapping.
  std::string type;
  std::size_t num_publishers = 0;
  double silence_s = 0.0;          ///< Since its last message, or the start of the node.
  bool is_simulated_time = false;  ///< use_sim_time, as with bags.
};

/// The first of these that applies:
///   - messages were dropped since the last report: warning with the reason;
///   - depth images have come without camera_info since then: warning;
///   - none has come for kMaxSilence_s, unless with simulated time and no publisher any more: warning;
///   - else: all is well.
[[nodiscard]] ReportSummary summarize(const SourceReport& report,
                                      const SourceStatistics& last_report);

/// Writes a report; one key for each figure.
void fillStatus(const SourceReport& report, const SourceStatistics& last_report,
                diagnostic_updater::DiagnosticStatusWrapper& status);

}  // namespace cuboid_mapping_ros
