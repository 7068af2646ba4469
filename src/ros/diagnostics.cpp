// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/diagnostics.h"

#include "cuboid_mapping/map/cuboid_search.h"

#include <diagnostic_msgs/DiagnosticStatus.h>

#include <sstream>

namespace cuboid_mapping_ros {
namespace {

/// Clouds dropped for a reason since the last report.
std::uint64_t countNew(const NodeReport& report, const NodeStatistics& last, DropReason reason) {
  return report.statistics.numDropped(reason) - last.numDropped(reason);
}

std::string describeDrops(const NodeReport& report, const NodeStatistics& last) {
  DropReason most_frequent = DropReason::kEmptyFrame;
  std::ostringstream text;
  text << report.statistics.numDropped() - last.numDropped() << " clouds dropped (";
  const char* separator = "";
  for (std::size_t i = 0; i < kNumDropReasons; ++i) {
    const auto reason = static_cast<DropReason>(i);
    const std::uint64_t count = countNew(report, last, reason);
    if (count == 0) continue;
    text << separator << toString(reason) << ": " << count;
    separator = ", ";
    if (count > countNew(report, last, most_frequent)) most_frequent = reason;
  }
  text << "): " << toAdvice(most_frequent);
  return text.str();
}

void addStage(const char* name, const StageTime& time,
              diagnostic_updater::DiagnosticStatusWrapper& status) {
  const std::string prefix = std::string(name) + " time ";
  status.addf(prefix + "last [ms]", "%.3f", time.lastMs());
  status.addf(prefix + "mean [ms]", "%.3f", time.meanMs());
  status.addf(prefix + "max [ms]", "%.3f", time.maxMs());
}

}  // namespace

MapSummary summarize(const cuboid_mapping::CuboidMap& map) {
  MapSummary summary;
  summary.revision = map.revision();
  summary.num_bytes = map.numBytes();
  const cuboid_mapping::CuboidCounts counts = countCuboids(map);
  summary.free = {counts.free, map.voxels().numFreeVoxels()};
  summary.occupied = {counts.occupied, map.voxels().numOccupiedVoxels()};
  summary.num_waiting = map.fusion().waiting().size();
  return summary;
}

ReportSummary summarize(const NodeReport& report, const NodeStatistics& last_report) {
  const NodeStatistics& now = report.statistics;
  std::ostringstream text;
  if (now.num_received == 0) {
    text << "no cloud on " << report.cloud_topic << " yet"
         << (report.num_publishers == 0 ? ", nobody publishes it" : "")
         << ": check the topic name and remapping, and that the sensor runs";
    return {true, text.str()};
  }
  if (now.numDropped() != last_report.numDropped()) {
    return {true, describeDrops(report, last_report)};
  }
  const bool is_stuck = now.numWaiting() > 0 && last_report.numWaiting() > 0 &&
                        now.num_inserted == last_report.num_inserted;
  if (is_stuck) {
    text << now.numWaiting()
         << " clouds wait for a transform: " << toAdvice(DropReason::kNoTransform);
    return {true, text.str()};
  }
  if (report.silence_s > kMaxSilence_s) {
    text << "no cloud on " << report.cloud_topic << " for " << static_cast<int>(report.silence_s)
         << " s: check that the sensor runs";
    return {true, text.str()};
  }
  text << report.map.free.num_cuboids + report.map.occupied.num_cuboids << " cuboids from "
       << now.num_inserted << " clouds";
  return {false, text.str()};
}

const char* toAdvice(DropReason reason) {
  switch (reason) {
    case DropReason::kQueueFull:
      return "the node is too slow for this rate of clouds; use a coarser resolution or a smaller "
             "sensor_model/max_range, or send fewer clouds";
    case DropReason::kNoTransform:
      return "check that tf has a path from the cloud's frame to frame_id at the cloud's stamp "
             "(rosrun tf tf_echo)";
    case DropReason::kTooOldForTf:
      return "check that the clocks of all machines agree, and use_sim_time with recorded data";
    case DropReason::kPaused: return "call ~pause with data: false to go on";
    case DropReason::kInternalError:
      return "see the log; a coarser resolution or a smaller sensor_model/max_range needs less "
             "memory";
    default: return "check the driver that publishes the cloud; the log says what is wrong with it";
  }
}

void fillStatus(const NodeReport& report, const NodeStatistics& last_report,
                diagnostic_updater::DiagnosticStatusWrapper& status) {
  using diagnostic_msgs::DiagnosticStatus;
  const ReportSummary summary = summarize(report, last_report);
  status.summary(summary.is_warning ? DiagnosticStatus::WARN : DiagnosticStatus::OK,
                 summary.message);

  const NodeStatistics& statistics = report.statistics;
  status.add("clouds received", statistics.num_received);
  status.add("clouds inserted", statistics.num_inserted);
  status.add("clouds waiting", statistics.numWaiting());
  status.add("clouds dropped", statistics.numDropped());
  for (std::size_t i = 0; i < kNumDropReasons; ++i) {
    const auto reason = static_cast<DropReason>(i);
    status.add(std::string("clouds dropped, ") + toString(reason), statistics.numDropped(reason));
  }
  status.add("points inserted", statistics.num_points);
  status.add("points NaN or without return", statistics.num_invalid);
  status.add("points filtered", statistics.num_filtered);
  status.add("points out of range", statistics.num_out_of_range);
  addStage("convert", statistics.convert_time, status);
  addStage("ray walk", statistics.ray_walk_time, status);
  addStage("apply", statistics.apply_time, status);
  status.add("cuboids free", report.map.free.num_cuboids);
  status.add("cuboids occupied", report.map.occupied.num_cuboids);
  status.add("bricks waiting to be fused", report.map.num_waiting);
  status.addf("voxels free", "%.0f", report.map.free.num_voxels);
  status.addf("voxels occupied", "%.0f", report.map.occupied.num_voxels);
  status.add("map bytes", report.map.num_bytes);
  status.add("map revision", report.map.revision);
  status.add("octomap_server messages built", report.num_built);
}

}  // namespace cuboid_mapping_ros
