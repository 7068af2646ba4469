// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/diagnostics/diagnostics.h"

#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/ros/middleware/published_topics.h"

#include <diagnostic_msgs/DiagnosticStatus.h>

#include <array>
#include <cmath>
#include <sstream>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

/// Clouds dropped for a reason since the last report.
std::uint64_t countNew(const NodeReport& report, const NodeStatistics& last, DropReason reason) {
  return report.statistics.numDropped(reason) - last.numDropped(reason);
}

/// Clouds dropped since the last report; those before the first transform are no fault.
std::uint64_t countNewFaults(const NodeReport& report, const NodeStatistics& last) {
  return report.statistics.numDropped() - last.numDropped() -
         countNew(report, last, DropReason::kBeforeTf);
}

/// Frames of the clouds and of the map.
std::string describeFrames(const NodeReport& report) {
  std::ostringstream text;
  if (!report.last_cloud) return {};
  text << "'" << report.last_cloud->frame_id << "' -> '" << report.frame_id << "'";
  return text.str();
}

/// Fault and cure if the stamps cannot be current; else empty.
std::string describeClock(const NodeReport& report) {
  if (!report.last_cloud) return {};
  if (!report.last_cloud->has_stamp) {
    return "the clouds have no stamp, and get the newest transforms: have the driver set "
           "header.stamp";
  }
  const double age_s = report.last_cloud->age_s;
  if (age_s < -kMaxAhead_s) {
    const std::string lead = "the stamps of the clouds are " + describeAge(age_s) + " ahead of ";
    if (report.is_simulated_time) {
      return lead +
             "/clock: play bags with --clock; for live sensors, `rosparam delete "
             "/use_sim_time` and start the node again";
    }
    return lead + "this machine's clock: synchronize the clocks (chrony, ntp)";
  }
  constexpr double kOld_s = 60.0;
  if (age_s > kOld_s) {
    return "the clouds are " + describeAge(age_s) + " old: " +
           (report.is_simulated_time ? "" : "set use_sim_time and play bags with --clock, or ") +
           "correct the driver's stamps";
  }
  return {};
}

std::string withClock(const std::string& text, const NodeReport& report) {
  const std::string clock = describeClock(report);
  return clock.empty() ? text : text + "; " + clock;
}

/// Adds that the stamps are old; of those that are ahead, the reason speaks itself.
std::string withAge(const std::string& why, const NodeReport& report) {
  const bool is_old = report.last_cloud && report.last_cloud->age_s > 0.0;
  return is_old ? withClock(why, report) : why;
}

std::string adviseOnDrops(DropReason reason, const NodeReport& report) {
  if (reason == DropReason::kQueueFull && report.speed_advice) return *report.speed_advice;
  const std::string& said = report.last_drops.at(static_cast<std::size_t>(reason));
  const std::string advice = said.empty() ? toAdvice(reason) : said;
  const bool is_of_tf = reason == DropReason::kNoTransform || reason == DropReason::kTooOldForTf;
  return is_of_tf ? withAge(advice, report) : advice;
}

/// The clouds dropped since the last report, by reason, and the advice on most of them. Those before the first
/// transform are left out beside faults.
std::string describeDrops(const NodeReport& report, const NodeStatistics& last) {
  const std::uint64_t num_faults = countNewFaults(report, last);
  const std::uint64_t num_before_tf = countNew(report, last, DropReason::kBeforeTf);
  DropReason most_frequent = DropReason::kEmptyFrame;
  std::ostringstream text;
  text << counted(num_faults > 0 ? num_faults : num_before_tf, "cloud") << " dropped (";
  const char* separator = "";
  for (std::size_t i = 0; i < kNumDropReasons; ++i) {
    const auto reason = static_cast<DropReason>(i);
    const std::uint64_t count = countNew(report, last, reason);
    const bool is_shown =
        reason == DropReason::kBeforeTf ? num_faults == 0 : count > 0 && !isEmpty(reason);
    if (!is_shown) continue;
    text << separator << toString(reason) << ": " << count;
    separator = ", ";
    if (count > countNew(report, last, most_frequent)) most_frequent = reason;
  }
  text << "): " << adviseOnDrops(most_frequent, report);
  return text.str();
}

/// Level of a fault that prevents clouds from entering the map.
ReportLevel levelOfFault(const NodeReport& report) {
  return report.starved_s > kMaxStarved_s ? ReportLevel::kError : ReportLevel::kWarning;
}

std::string describeMap(const NodeReport& report) {
  const NodeStatistics& statistics = report.statistics;
  std::string text = counted(report.map.cuboids.total(), "cuboid") + " from " +
                     counted(statistics.num_inserted, "cloud");
  if (statistics.num_inserted == 0 && statistics.numEmpty() > 0) {
    text += "; " + counted(statistics.numEmpty(), "cloud") +
            " had no valid point: check that nothing covers the sensor, and any filters before "
            "this node";
  }
  return text;
}

std::optional<double> greatestRate(const NodeReport& report) {
  std::optional<double> greatest_hz;
  for (const SourceRate& rate : report.rates) greatest_hz = std::max(greatest_hz, {rate.rate_hz});
  return greatest_hz;
}

ReportSummary summarizeSilence(const NodeReport& report) {
  const bool is_map_empty = report.statistics.num_inserted == 0;
  if (is_map_empty && report.statistics.numDropped() > 0) {
    return {ReportLevel::kWarning, "no cloud has got into the map, and none arrives any more: " +
                                       describeDrops(report, {})};
  }
  const bool has_publisher = report.num_publishers > 0;
  if (!has_publisher && report.is_simulated_time) {
    const std::uint64_t num_dropped = report.statistics.numDropped();
    return {ReportLevel::kOk,
            describeMap(report) +
                (num_dropped == 0 ? "" : ", " + std::to_string(num_dropped) + " dropped") +
                "; the recording has ended: nobody publishes " + report.cloud_topic + " any more"};
  }
  std::ostringstream text;
  text << "no cloud on " << report.cloud_topic << " for " << static_cast<int>(report.silence_s)
       << (has_publisher
               ? " s: check that the sensor is running"
               : " s, nobody publishes it any more: a bag has ended or the driver has stopped");
  return {has_publisher && report.silence_s > kErrorSilence_s ? ReportLevel::kError
                                                              : ReportLevel::kWarning,
          text.str()};
}

void addStage(const char* name, const StageTime& time,
              diagnostic_updater::DiagnosticStatusWrapper& status) {
  const std::string prefix = std::string(name) + " time ";
  status.addf(prefix + "last [ms]", "%.3f", time.lastMs());
  status.addf(prefix + "mean [ms]", "%.3f", time.meanMs());
  status.addf(prefix + "max [ms]", "%.3f", time.maxMs());
}

void addLastCloud(const NodeReport& report, diagnostic_updater::DiagnosticStatusWrapper& status) {
  status.add("frames", describeFrames(report));
  const std::string fault = describeClock(report);
  if (fault.empty()) {
    status.addf("cloud age when received [s]", "%.3f", report.last_cloud->age_s);
  } else {
    status.add("cloud age when received", fault);
  }
}

void addWindow(const NodeReport& report, diagnostic_updater::DiagnosticStatusWrapper& status) {
  const WindowFigures& window = *report.window;
  status.add("window parts in memory", window.num_in_memory);
  status.add("window parts on disk only", window.num_on_disk_only);
  status.add("topics show", window.num_on_disk_only > 0 ? "the part in memory" : "the whole map");
  status.add("window parts read", window.num_loads);
  status.add("window parts written", window.num_writes);
  const auto add_if_any = [&status](const char* key, std::uint64_t count) {
    if (count > 0) status.add(key, count);
  };
  add_if_any("window parts forgotten", window.num_forgotten);
  add_if_any("window bricks refused", window.num_refused);
  add_if_any("window bricks lost to unreadable parts", window.num_unreadable);
  add_if_any("window failures", window.num_failures);
  if (window.num_failures > 0) status.add("window failures, last", window.last_failure);
  if (report.num_new_window_failures > 0) {
    status.mergeSummary(diagnostic_msgs::DiagnosticStatus::ERROR,
                        "the map on disk: " + window.last_failure);
  }
}

void addKept(const NodeReport& report, diagnostic_updater::DiagnosticStatusWrapper& status) {
  status.add("clouds kept", report.kept->num_clouds);
  status.add("clouds kept, bytes", report.kept->num_bytes);
  status.add("clouds kept, points", report.kept->num_points);
  status.add("clouds no longer kept", report.kept->num_fixed);
  if (!report.kept_error.empty()) {
    status.mergeSummary(diagnostic_msgs::DiagnosticStatus::ERROR, report.kept_error);
  }
}

}  // namespace

MapSummary MapWatch::summarize(const CuboidMap& map) {
  constexpr double kShare = 0.05;
  const double begin_s = clock_s_();
  if (counted_revision_ != map.revision() && begin_s >= next_count_s_) {
    counts_ = countCuboids(map);
    num_bytes_ = map.numBytes();
    counted_revision_ = map.revision();
    const double end_s = clock_s_();
    next_count_s_ = end_s + (end_s - begin_s) / kShare;
  }
  return {map.revision(), counts_, map.voxels().numFreeVoxels(), map.voxels().numOccupiedVoxels(),
          num_bytes_};
}

ReportSummary summarize(const NodeReport& report, const NodeStatistics& last_report) {
  const NodeStatistics& now = report.statistics;
  if (!report.autosave_error.empty()) {
    return {ReportLevel::kError, "the map could not be saved: " + report.autosave_error};
  }
  if (now.num_received == 0) {
    if (!report.wrong_types.empty())
      return {ReportLevel::kError, "no cloud yet: " + report.wrong_types};
    return {
        ReportLevel::kWarning,
        "no cloud on " + report.cloud_topic + " yet" +
            describeUnheard(report.num_publishers, report.is_published,
                            std::string("check the topic name and its remapping, and that the ") +
                                (report.is_simulated_time
                                     ? "bag still plays; if it ended before this node was ready, "
                                       "play it again (replay.launch: with a longer delay)"
                                     : "sensor is running")) +
            (report.other_topics.empty() ? ""
                                         : ". Published with this type: " + report.other_topics)};
  }
  if (countNewFaults(report, last_report) > 0) {
    const bool is_wanted = countNew(report, last_report, DropReason::kPaused) > 0;
    return {is_wanted ? ReportLevel::kWarning : levelOfFault(report),
            describeDrops(report, last_report)};
  }
  if (isStuck(now, last_report)) {
    const std::string clouds =
        counted(now.numWaiting(), "cloud") + (now.numWaiting() == 1 ? " waits" : " wait");
    // A cloud may take longer than the time between two reports.
    if (report.why_waiting.empty()) {
      const bool has_no_camera =
          now.num_inserted == 0 && now.numDropped(DropReason::kNoCameraInfo) > 0;
      if (has_no_camera) {
        return {levelOfFault(report),
                clouds + " for camera_info: " + toAdvice(DropReason::kNoCameraInfo)};
      }
      return {levelOfFault(report), clouds + ": " + report.speed_advice.value_or("for their turn")};
    }
    return {levelOfFault(report),
            clouds + " for a transform: " + withAge(report.why_waiting, report)};
  }
  if (report.silence_s > maxSilence_s(greatestRate(report), now.num_inserted))
    return summarizeSilence(report);
  if (report.last_cloud && report.last_cloud->age_s < -kMaxAhead_s) {
    return {ReportLevel::kWarning, withClock(describeMap(report), report)};
  }
  const std::string why_empty = describeNothingLeft(now);
  if (!why_empty.empty()) {
    return {now.num_on_robot > 0 ? ReportLevel::kWarning : ReportLevel::kOk, why_empty};
  }
  return {ReportLevel::kOk, withClock(describeMap(report), report)};
}

std::string describeNothingLeft(const PointCounts& points) {
  if (points.num_points > 0) return {};
  if (points.num_on_robot > 0) {
    return "no point is left, since they lie on the robot: check the boxes and the URDF of "
           "self_filter, whose meshes in millimetres need a scale of 0.001";
  }
  if (points.num_filtered > 0) {
    return "no point is left: check sensor_model/min_range and the limits pointcloud_*";
  }
  return {};
}

std::string describeAge(double age_s) {
  constexpr std::array<std::pair<double, const char*>, 4> kUnits{
      {{365.25 * 86400.0, " years"}, {86400.0, " days"}, {3600.0, " h"}, {60.0, " min"}}};
  const double size_s = std::abs(age_s);
  for (const auto& [unit_s, name] : kUnits) {
    if (size_s >= 2.0 * unit_s) return std::to_string(std::llround(size_s / unit_s)) + name;
  }
  std::ostringstream text;
  text.precision(3);
  text << size_s << " s";
  return text.str();
}

void fillStatus(const NodeReport& report, const NodeStatistics& last_report,
                diagnostic_updater::DiagnosticStatusWrapper& status) {
  using diagnostic_msgs::DiagnosticStatus;
  static_assert(static_cast<int>(ReportLevel::kWarning) == DiagnosticStatus::WARN);
  static_assert(static_cast<int>(ReportLevel::kError) == DiagnosticStatus::ERROR);
  const ReportSummary summary = summarize(report, last_report);
  status.summary(static_cast<unsigned char>(summary.level), summary.message);

  const NodeStatistics& statistics = report.statistics;
  const auto add_if_any = [&status](const std::string& key, std::uint64_t count) {
    if (count > 0) status.add(key, count);
  };
  if (report.is_paused) status.add("paused", true);
  status.add("clouds received", statistics.num_received);
  status.add("clouds inserted", statistics.num_inserted);
  status.add("clouds waiting", statistics.numWaiting());
  if (!report.why_waiting.empty()) status.add("clouds waiting, oldest", report.why_waiting);
  status.add("clouds dropped", statistics.numDropped());
  for (std::size_t i = 0; i < kNumDropReasons; ++i) {
    const auto reason = static_cast<DropReason>(i);
    add_if_any(
        (isEmpty(reason) ? "clouds empty, " : "clouds dropped, ") + std::string(toString(reason)),
        statistics.numDropped(reason));
  }
  status.addf("map behind [s]", "%.3f", report.lag_s);
  status.add("points inserted", statistics.num_points);
  add_if_any("points NaN or without return", statistics.num_invalid);
  add_if_any("points with an odd time", statistics.num_odd_times);
  add_if_any("points filtered", statistics.num_filtered);
  add_if_any("points on the robot", statistics.num_on_robot);
  add_if_any("points out of range", statistics.num_out_of_range);
  add_if_any("points too far", statistics.num_too_far);
  if (report.last_cloud) addLastCloud(report, status);
  for (const SourceRate& rate : report.rates) {
    status.addf(rate.name.empty() ? "cloud rate [Hz]" : "cloud rate of " + rate.name + " [Hz]",
                "%.2f", rate.rate_hz);
  }
  if (report.speed_advice) status.add("next step", *report.speed_advice);
  status.addf("cloud reach [m]", "%.1f", statistics.reach_m);
  addStage("convert", statistics.convert_time, status);
  addStage("ray walk", statistics.ray_walk_time, status);
  addStage("apply", statistics.apply_time, status);
  status.add("cuboids free", report.map.cuboids.free);
  status.add("cuboids occupied", report.map.cuboids.occupied);
  status.addf("voxels free", "%.0f", report.map.num_free_voxels);
  status.addf("voxels occupied", "%.0f", report.map.num_occupied_voxels);
  status.add("map bytes", report.map.num_bytes);
  status.add("map revision", report.map.revision);
  if (report.window) addWindow(report, status);
  if (report.kept) addKept(report, status);
  add_if_any("octomap_server messages built", report.num_built);
  add_if_any("callbacks failed", report.num_failures);
  if (report.num_failures > 0) status.add("callbacks failed, last", report.last_failure);
  if (report.num_new_failures > 0) {
    status.mergeSummary(DiagnosticStatus::ERROR,
                        "a callback failed: " + report.last_failure +
                            "; the node keeps running; please report this");
  }
}

}  // namespace cuboid_mapping_ros
