// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/ros/node_statistics.h"

#include <diagnostic_updater/DiagnosticStatusWrapper.h>

#include <cstddef>
#include <cstdint>
#include <string>

namespace cuboid_mapping_ros {

/// Extent of the cuboids of one class.
struct ClassSummary {
  std::size_t num_cuboids = 0;
  double num_voxels = 0.0;
};

/// Figures of the map for the diagnostics.
struct MapSummary {
  std::uint64_t revision = 0;
  ClassSummary free;
  ClassSummary occupied;
  std::size_t num_waiting = 0;  ///< Bricks whose cuboids are not in the R-tree yet.
  std::size_t num_bytes = 0;    ///< Of voxels and R-tree.
};

/// What the map says of itself. @complexity O(n).
[[nodiscard]] MapSummary summarize(const cuboid_mapping::CuboidMap& map);

/// Everything that one report is about.
struct NodeReport {
  NodeStatistics statistics;
  MapSummary map;
  std::string cloud_topic;         ///< As it is after remapping.
  std::size_t num_publishers = 0;  ///< Of the cloud topic.
  double silence_s = 0.0;          ///< Since the last cloud, or the start of the node.
  std::uint64_t num_built = 0;     ///< Messages on the topics of octomap_server.
};

/// Clouds are missing when none has come for so long.
constexpr double kMaxSilence_s = 5.0;

/// Level and message of a report.
struct ReportSummary {
  bool is_warning;
  std::string message;  ///< What is wrong and what to do, or what the map holds.
};

/// The first of these that applies:
///   - no cloud has ever come: warning;
///   - clouds were dropped since the last report: warning that names the most frequent reason;
///   - clouds wait for tf, as at the last report, and none was inserted since: warning;
///   - no cloud for kMaxSilence_s: warning;
///   - else: all is well.
[[nodiscard]] ReportSummary summarize(const NodeReport& report, const NodeStatistics& last_report);

/// What to do about clouds that are dropped, as a clause that follows "dropped: ".
[[nodiscard]] const char* toAdvice(DropReason reason);

/// Writes a report; one key for each figure.
void fillStatus(const NodeReport& report, const NodeStatistics& last_report,
                diagnostic_updater::DiagnosticStatusWrapper& status);

}  // namespace cuboid_mapping_ros
