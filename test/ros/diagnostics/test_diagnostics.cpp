// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/diagnostics/diagnostics.h"

#include "cuboid_mapping/scan/scan_update.h"

#include <diagnostic_msgs/DiagnosticStatus.h>
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

NodeReport makeReport(std::uint64_t num_received, std::uint64_t num_inserted) {
  NodeReport report;
  report.cloud_topic = "/points";
  report.num_publishers = 1;
  report.statistics.num_received = num_received;
  report.statistics.num_inserted = num_inserted;
  return report;
}

/// Expects these words, in this order.
void expectWords(const ReportSummary& summary, const std::vector<std::string>& words) {
  std::size_t at = 0;
  for (const std::string& word : words) {
    at = summary.message.find(word, at);
    ASSERT_NE(at, std::string::npos) << "'" << word << "' in '" << summary.message << "'";
  }
}

/// Expects a warning with these words, in this order.
void expectWarning(const ReportSummary& summary, const std::vector<std::string>& words) {
  EXPECT_EQ(summary.level, ReportLevel::kWarning) << summary.message;
  expectWords(summary, words);
}

bool isOk(const ReportSummary& summary) { return summary.level == ReportLevel::kOk; }

TEST(Diagnostics, AllIsWellWhileCloudsAreInserted) {
  NodeReport report = makeReport(7, 7);
  report.map.cuboids.free = 30;
  report.map.cuboids.occupied = 12;
  const ReportSummary summary = summarize(report, makeReport(5, 5).statistics);
  EXPECT_TRUE(isOk(summary));
  EXPECT_EQ(summary.message, "42 cuboids from 7 clouds");
}

TEST(Diagnostics, WarnsWhileNoCloudHasCome) {
  NodeReport report = makeReport(0, 0);
  expectWarning(summarize(report, {}), {"no cloud on /points yet", "topic name and its remapping"});
  EXPECT_EQ(summarize(report, {}).message.find("nobody publishes"), std::string::npos);
  report.num_publishers = 0;
  expectWarning(summarize(report, {}), {"no cloud on /points yet", "nobody publishes it"});
  report.is_simulated_time = true;
  expectWarning(summarize(report, {}), {"if it ended before this node was ready", "delay"});
  report.is_simulated_time = false;
  report.other_topics = "/front, /rear";
  expectWarning(summarize(report, {}), {"nobody publishes it", "with this type: /front, /rear"});
  report.is_published = true;
  expectWarning(summarize(report, {}), {"though it is published", "ROS_IP", "another version"});
  report.wrong_types = "/points is a scan";
  EXPECT_EQ(summarize(report, {}).level, ReportLevel::kError);
  EXPECT_EQ(summarize(report, {}).message, "no cloud yet: /points is a scan");
}

TEST(Diagnostics, WarnsOfCloudsDroppedSinceTheLastReport) {
  const NodeReport last = makeReport(5, 5);
  NodeReport report = makeReport(10, 6);
  report.statistics.numDropped(DropReason::kShortData) = 1;
  report.statistics.numDropped(DropReason::kNoTransform) = 3;
  expectWarning(
      summarize(report, last.statistics),
      {"4 clouds dropped", "short data: 1", "no transform: 3", "check that tf has a path"});
  const auto say = [&report](DropReason reason, const std::string& text) {
    report.last_drops.at(static_cast<std::size_t>(reason)) = text;
  };
  say(DropReason::kShortData, "it has 5 bytes");
  say(DropReason::kNoTransform, "frame 'laser': nobody publishes 'laser'");
  report.last_cloud = LastCloud{"lidar", 0.0};
  expectWarning(summarize(report, last.statistics), {"frame 'laser': nobody publishes 'laser'"});
  report.statistics = makeReport(6, 5).statistics;
  report.statistics.numDropped(DropReason::kShortData) = 1;
  expectWarning(summarize(report, last.statistics),
                {"1 cloud dropped (short data: 1): it has 5 bytes"});
  report = makeReport(10, 6);
  report.statistics.numDropped(DropReason::kNoTransform) = 4;
  EXPECT_TRUE(isOk(summarize(report, report.statistics))) << "told once";
}

TEST(Diagnostics, WarnsOfCloudsThatGoOnWaitingForTf) {
  const NodeReport last = makeReport(6, 5);
  EXPECT_TRUE(isOk(summarize(last, makeReport(5, 5).statistics))) << "it may come yet";
  NodeReport report = makeReport(8, 5);
  report.last_cloud = LastCloud{"lidar", 0.0};
  report.why_waiting = "tf is 0.02 s older than the last point";
  expectWarning(summarize(report, last.statistics), {"3 clouds wait for a transform", "0.02 s"});
  EXPECT_TRUE(isOk(summarize(makeReport(8, 6), last.statistics)));
  report.statistics.numDropped(DropReason::kNoValidPoints) = 2;
  EXPECT_TRUE(isOk(summarize(report, last.statistics))) << "two had nothing to map";
}

TEST(Diagnostics, WarnsWhenCloudsDoNotComeAnyMore) {
  NodeReport report = makeReport(3, 3);
  report.silence_s = kErrorSilence_s;
  EXPECT_TRUE(isOk(summarize(report, report.statistics))) << "it may be a slow sensor";
  report.statistics.num_inserted = 0;
  report.statistics.numDropped(DropReason::kNoTransform) = 3;
  expectWarning(summarize(report, report.statistics), {"no cloud has got into the map"});
  report = makeReport(5, 5);
  report.silence_s = kMaxSilence_s;
  EXPECT_TRUE(isOk(summarize(report, report.statistics)));
  report.silence_s = 12.5;
  expectWarning(summarize(report, report.statistics), {"no cloud on /points for 12 s"});
  report.rates = {{"slow", 0.2}, {"slower", 0.01}};
  EXPECT_TRUE(isOk(summarize(report, report.statistics))) << "a cloud of it comes every 5 s";
  report.silence_s = 15.5;
  expectWarning(summarize(report, report.statistics), {"no cloud on /points for 15 s"});
}

TEST(Diagnostics, AClockThatIsAheadIsNamed) {
  NodeReport report = makeReport(5, 5);
  report.frame_id = "map";
  report.last_cloud = LastCloud{"lidar", -3.25};
  expectWarning(summarize(report, report.statistics),
                {"from 5 clouds", "3.25 s ahead of this machine's clock"});
  report.last_cloud->age_s = -0.9 * kMaxAhead_s;
  EXPECT_TRUE(isOk(summarize(report, report.statistics)));
}

TEST(Diagnostics, ASimulatedClockThatStandsIsNamed) {
  NodeReport report = makeReport(5, 5);
  report.is_simulated_time = true;
  report.last_cloud = LastCloud{"lidar", -1.6e9};
  expectWarning(summarize(report, report.statistics),
                {"51 years ahead of /clock", "--clock", "rosparam delete /use_sim_time"});
}

TEST(Diagnostics, OldStampsAreToldInWords) {
  NodeReport report = makeReport(5, 5);
  report.last_cloud = LastCloud{"lidar", 59.0};
  EXPECT_EQ(summarize(report, report.statistics).message, "0 cuboids from 5 clouds");
  report.last_cloud->age_s = 1.3e8;
  const ReportSummary summary = summarize(report, report.statistics);
  EXPECT_TRUE(isOk(summary));
  expectWords(summary, {"from 5 clouds", "the clouds are 4 years old", "use_sim_time", "--clock"});
  report.is_simulated_time = true;
  EXPECT_EQ(summarize(report, report.statistics).message,
            "0 cuboids from 5 clouds; the clouds are 4 years old: correct the driver's stamps");
  diagnostic_updater::DiagnosticStatusWrapper status;
  fillStatus(report, report.statistics, status);
  for (const auto& entry : status.values) {
    EXPECT_EQ(entry.value.find("130000000"), std::string::npos) << entry.key;
  }
}

TEST(Diagnostics, CloudsWithoutStampAreNoOldOnes) {
  NodeReport report = makeReport(5, 5);
  report.last_cloud = LastCloud{"lidar", 1.6e9, false};
  const ReportSummary summary = summarize(report, report.statistics);
  EXPECT_EQ(summary.message.find("old"), std::string::npos) << summary.message;
  expectWords(summary, {"the clouds have no stamp", "set header.stamp"});
}

TEST(Diagnostics, ImagesThatWaitForCameraInfoSaySo) {
  NodeReport report = makeReport(8, 0);
  report.statistics.numDropped(DropReason::kNoCameraInfo) = 5;
  report.last_cloud = LastCloud{"camera", 0.1};
  expectWarning(summarize(report, report.statistics),
                {"3 clouds wait for camera_info", "publisher"});
}

TEST(Diagnostics, AMissingTransformIsNamedWithFramesAgeAndReason) {
  NodeReport report = makeReport(8, 5);
  report.frame_id = "map";
  report.last_cloud = LastCloud{"lidar", 86400.0 * 30};
  report.why_waiting = "frame 'laser': frame 'odom' does not exist";
  expectWarning(summarize(report, makeReport(6, 5).statistics),
                {"3 clouds wait for a transform", "frame 'laser': frame 'odom' does not exist",
                 "the clouds are 30 days old", "use_sim_time"});
  report.statistics = makeReport(6, 5).statistics;
  expectWarning(summarize(report, report.statistics), {"1 cloud waits for a transform"});
}

TEST(Diagnostics, AgesAreInUnitsThatPeopleUse) {
  NodeReport report = makeReport(5, 5);
  for (const auto& [age_s, text] : {std::pair(-30.0, "30 s"),
                                    {119.0, "119 s"},
                                    {3000.0, "50 min"},
                                    {7200.0, "2 h"},
                                    {86400.0, "24 h"},
                                    {172800.0, "2 days"},
                                    {86400.0 * 731, "2 years"}}) {
    report.last_cloud = LastCloud{"lidar", age_s};
    expectWords(summarize(report, report.statistics), {std::string(" ") + text});
  }
}

TEST(Diagnostics, ItIsAnErrorWhenNothingGetsIntoTheMap) {
  NodeReport report = makeReport(10, 5);
  report.statistics.numDropped(DropReason::kNoTransform) = 5;
  report.starved_s = kMaxStarved_s - 0.1;
  EXPECT_EQ(summarize(report, makeReport(5, 5).statistics).level, ReportLevel::kWarning);
  report.starved_s = kMaxStarved_s + 0.1;
  EXPECT_EQ(summarize(report, makeReport(5, 5).statistics).level, ReportLevel::kError);
  EXPECT_EQ(summarize(makeReport(8, 5), makeReport(7, 5).statistics).level, ReportLevel::kWarning);
  NodeReport stuck = makeReport(8, 5);
  stuck.starved_s = kMaxStarved_s + 0.1;
  EXPECT_EQ(summarize(stuck, makeReport(7, 5).statistics).level, ReportLevel::kError);
}

TEST(Diagnostics, AfterABagWhoseCloudsWereAllDroppedTheReasonStays) {
  NodeReport report = makeReport(3, 0);
  report.statistics.numDropped(DropReason::kNoTransform) = 3;
  report.last_drops.at(static_cast<std::size_t>(DropReason::kNoTransform)) =
      "frame 'world' does not exist";
  report.silence_s = kErrorSilence_s + 1.0;
  report.num_publishers = 0;
  for (const bool is_simulated_time : {false, true}) {
    report.is_simulated_time = is_simulated_time;
    expectWarning(summarize(report, report.statistics),
                  {"no cloud has got into the map", "3 clouds dropped (no transform: 3)",
                   "frame 'world' does not exist"});
  }
}

TEST(Diagnostics, ASilentSensorBecomesAnErrorAndTheEndOfABagDoesNot) {
  NodeReport report = makeReport(5, 5);
  report.silence_s = kErrorSilence_s + 1.0;
  EXPECT_EQ(summarize(report, report.statistics).level, ReportLevel::kError);
  report.num_publishers = 0;
  expectWarning(summarize(report, report.statistics),
                {"nobody publishes it any more", "a bag has ended"});
  report.is_simulated_time = true;
  const ReportSummary summary = summarize(report, report.statistics);
  EXPECT_TRUE(isOk(summary)) << summary.message;
  expectWords(summary, {"from 5 clouds", "the recording has ended"});
}

TEST(Diagnostics, AFailedAutosaveIsAnError) {
  NodeReport report = makeReport(5, 5);
  report.autosave_error = "cannot write /full/a.cuboids: No space left on device";
  const ReportSummary summary = summarize(report, report.statistics);
  EXPECT_EQ(summary.level, ReportLevel::kError);
  expectWords(summary, {"the map could not be saved", "No space left on device"});
}

TEST(Diagnostics, AFullQueueSaysWhatWouldKeepUp) {
  NodeReport report = makeReport(10, 5);
  report.statistics.numDropped(DropReason::kQueueFull) = 5;
  report.speed_advice = "4.3 s per cloud at 10 Hz: try resolution 0.2";
  expectWarning(summarize(report, makeReport(5, 5).statistics),
                {"5 clouds dropped (queue full: 5): 4.3 s per cloud at 10 Hz"});
}

TEST(Diagnostics, CloudsThatWaitForASlowNodeDoNotWaitForTf) {
  NodeReport report = makeReport(8, 5);
  report.last_cloud = LastCloud{"lidar", 0.1};
  report.speed_advice = "4.3 s per cloud at 10 Hz: try resolution 0.2";
  const ReportSummary summary = summarize(report, makeReport(6, 5).statistics);
  expectWarning(summary, {"3 clouds wait: 4.3 s per cloud", "try resolution 0.2"});
  EXPECT_EQ(summary.message.find("transform"), std::string::npos) << summary.message;
  report.why_waiting = "frame 'odom' does not exist";
  expectWarning(summarize(report, makeReport(6, 5).statistics), {"3 clouds wait for a transform"});
}

TEST(Diagnostics, TheEndOfARecordingSaysHowManyCloudsAreMissing) {
  NodeReport report = makeReport(10, 6);
  report.silence_s = 60.0;
  report.is_simulated_time = true;
  report.num_publishers = 0;
  report.statistics.numDropped(DropReason::kQueueFull) = 4;
  expectWords(summarize(report, report.statistics),
              {"from 6 clouds, 4 dropped; the recording has ended"});
}

TEST(Diagnostics, CountsCuboidsAndVoxelsByClass) {
  cuboid_mapping::MapConfig config;
  config.resolution_m = 0.1;
  cuboid_mapping::CuboidMap map(config);
  cuboid_mapping::Scan scan;
  scan.origin = {0.05F, 0.05F, 0.05F};
  scan.points = {{1.05F, 0.05F, 0.05F}};
  cuboid_mapping::ScanUpdater updater(map.grid());
  map.apply(updater.compute(scan));
  const MapSummary summary = MapWatch([] { return 0.0; }).summarize(map);
  // Ten free voxels in two bricks, and one occupied.
  EXPECT_EQ(summary.cuboids.free, 2U);
  EXPECT_EQ(summary.num_free_voxels, 10.0);
  EXPECT_EQ(summary.cuboids.occupied, 1U);
  EXPECT_EQ(summary.num_occupied_voxels, 1.0);
  EXPECT_EQ(summary.revision, map.revision());
  EXPECT_EQ(summary.num_bytes, map.numBytes());
}

TEST(Diagnostics, CuboidsAreNotCountedAllTheTime) {
  double now_s = 0.0;
  MapWatch watch([&now_s] { return now_s += 1.0; });  // Each count takes a second.
  cuboid_mapping::CuboidMap map(cuboid_mapping::MapConfig{});
  cuboid_mapping::ScanUpdater updater(map.grid());
  cuboid_mapping::Scan scan;
  scan.origin = {0.01F, 0.01F, 0.01F};
  const auto observe = [&](float x_m) {
    scan.points = {{x_m, 0.01F, 0.01F}};
    map.apply(updater.compute(scan));
  };
  observe(1.01F);
  EXPECT_EQ(watch.summarize(map).cuboids.free, 3U) << "at first";
  const std::size_t num_bytes = map.numBytes();
  observe(2.01F);
  ASSERT_NE(map.numBytes(), num_bytes);
  const MapSummary summary = watch.summarize(map);
  EXPECT_EQ(summary.cuboids.free, 3U) << "so soon, the count is that of before";
  EXPECT_EQ(summary.num_bytes, num_bytes);
  EXPECT_EQ(summary.num_free_voxels, map.voxels().numFreeVoxels()) << "what costs nothing is new";
  now_s += 20.0;
  const std::size_t num_free = countCuboids(map).free;
  EXPECT_GT(num_free, 3U);
  EXPECT_EQ(watch.summarize(map).cuboids.free, num_free);
  observe(4.01F);
  EXPECT_EQ(watch.summarize(map).cuboids.free, num_free);
  now_s += 20.0;
  EXPECT_EQ(watch.summarize(map).cuboids.free, countCuboids(map).free) << "a twentieth of the time";
  const double before_s = now_s;
  now_s += 100.0;
  (void)watch.summarize(map);
  EXPECT_EQ(now_s, before_s + 101.0) << "nothing has changed: nothing is counted";
}

TEST(Diagnostics, EmptyCloudsAreNoFault) {
  const NodeReport last = makeReport(5, 5);
  NodeReport report = makeReport(9, 5);
  report.statistics.numDropped(DropReason::kNoPoints) = 3;
  report.statistics.numDropped(DropReason::kNoValidPoints) = 1;
  report.starved_s = kMaxStarved_s + 1.0;
  EXPECT_TRUE(isOk(summarize(report, last.statistics)));
  EXPECT_EQ(report.statistics.numDropped(), 0U);
  EXPECT_EQ(report.statistics.numWaiting(), 0U);
  report = makeReport(4, 0);
  report.statistics.numDropped(DropReason::kNoValidPoints) = 4;
  const ReportSummary summary = summarize(report, {});
  EXPECT_TRUE(isOk(summary));
  expectWords(summary, {"4 clouds had no valid point", "nothing covers the sensor"});
}

TEST(Diagnostics, CloudsOfWhichFiltersLeaveNothingAreNamed) {
  NodeReport report = makeReport(9, 9);
  report.statistics.num_filtered = 400;
  const ReportSummary summary = summarize(report, {});
  EXPECT_TRUE(isOk(summary)) << "a camera may look at nothing but the floor";
  expectWords(summary, {"no point is left", "pointcloud_*"});
  report.statistics.num_on_robot = 4000;
  expectWarning(summarize(report, {}), {"no point is left", "self_filter", "0.001"});
  report.statistics.num_points = 1;
  EXPECT_EQ(summarize(report, {}).message, "0 cuboids from 9 clouds");
}

TEST(Diagnostics, CloudsBeforeTheFirstTransformAreNoFault) {
  NodeReport report = makeReport(9, 5);
  report.statistics.numDropped(DropReason::kBeforeTf) = 4;
  EXPECT_TRUE(isOk(summarize(report, makeReport(5, 5).statistics)));
  report.statistics.num_received += 1;
  report.statistics.numDropped(DropReason::kTfGap) = 1;
  expectWarning(summarize(report, makeReport(5, 5).statistics), {"in a gap of tf: 1", "tf_gap"});
}

TEST(Diagnostics, WhatHasNotOccurredHasNoKey) {
  NodeReport report = makeReport(5, 4);
  report.statistics.numDropped(DropReason::kShortData) = 1;
  report.lag_s = 0.25;
  diagnostic_updater::DiagnosticStatusWrapper status;
  fillStatus(report, {}, status);
  std::map<std::string, std::string> values;
  for (const auto& value : status.values) values[value.key] = value.value;
  EXPECT_EQ(values["clouds dropped, short data"], "1");
  EXPECT_EQ(values["map behind [s]"], "0.250");
  for (const char* key : {"clouds dropped, queue full", "clouds empty, no points", "paused",
                          "points filtered", "callbacks failed", "next step"}) {
    EXPECT_EQ(values.count(key), 0U) << key;
  }
}

TEST(Diagnostics, EveryReasonHasItsOwnKeyAndAdvice) {
  NodeReport report = makeReport(193, 10);
  for (std::size_t i = 0; i < kNumDropReasons; ++i) report.statistics.num_dropped[i] = i + 1;
  report.statistics.convert_time.add(1.0);
  report.statistics.convert_time.add(4.0);
  report.map = {77, {5, 6}, 50.0, 6e10, 8000};
  report.num_built = 31;
  report.frame_id = "map";
  report.last_cloud = LastCloud{"lidar", 0.125};
  report.rates = {{"", 10.0}};
  report.statistics.reach_m = 78.25;
  report.why_waiting = "map <- lidar";
  diagnostic_updater::DiagnosticStatusWrapper status;
  fillStatus(report, {}, status);
  EXPECT_EQ(status.level, static_cast<int>(diagnostic_msgs::DiagnosticStatus::WARN));
  std::map<std::string, std::string> values;
  for (const auto& value : status.values) values[value.key] = value.value;
  EXPECT_EQ(values.size(), status.values.size()) << "no key twice";
  for (std::size_t i = 0; i < kNumDropReasons; ++i) {
    const auto reason = static_cast<DropReason>(i);
    const std::string prefix = isEmpty(reason) ? "clouds empty, " : "clouds dropped, ";
    EXPECT_EQ(values[prefix + toString(reason)], std::to_string(i + 1));
    EXPECT_GT(std::string(toAdvice(reason)).size(), 20U);
  }
  EXPECT_EQ(values["clouds received"], "193");
  EXPECT_EQ(values["clouds inserted"], "10");
  EXPECT_EQ(values["clouds dropped"], "162");
  EXPECT_EQ(values["clouds waiting"], "12");
  EXPECT_EQ(values["clouds waiting, oldest"], "map <- lidar");
  EXPECT_EQ(values["convert time last [ms]"], "4.000");
  EXPECT_EQ(values["convert time mean [ms]"], "2.500");
  EXPECT_EQ(values["convert time max [ms]"], "4.000");
  EXPECT_EQ(values["cuboids free"], "5");
  EXPECT_EQ(values["cuboids occupied"], "6");
  EXPECT_EQ(values["voxels free"], "50");
  EXPECT_EQ(values["voxels occupied"], "60000000000");
  EXPECT_EQ(values["map bytes"], "8000");
  EXPECT_EQ(values["map revision"], "77");
  EXPECT_EQ(values["octomap_server messages built"], "31");
  EXPECT_EQ(values["frames"], "'lidar' -> 'map'");
  EXPECT_EQ(values["cloud age when received [s]"], "0.125");
  EXPECT_EQ(values["cloud rate [Hz]"], "10.00");
  EXPECT_EQ(values.count("callbacks failed, last"), 0U) << "there was none";
}

}  // namespace
}  // namespace cuboid_mapping_ros
