// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/mapping/node_sources.h"
#include "cuboid_mapping/ros/mapping/sensor_input.h"
#include "cuboid_mapping/ros/middleware/rate_limit.h"
#include "cuboid_mapping/ros/parameters/reconfigure.h"
#include "ros/cloud_messages.h"
#include "ros/known_parameters.h"
#include "tools/run_program.h"
#include "yaml_parameters.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::Occupancy;
using XmlRpc::XmlRpcValue;

XmlRpcValue makeSource(const std::string& name, const std::string& topic) {
  XmlRpcValue source;
  source["name"] = name;
  source["topic"] = topic;
  return source;
}

XmlRpcValue listOf(const std::vector<XmlRpcValue>& elements) {
  XmlRpcValue list;
  list.setSize(static_cast<int>(elements.size()));
  for (int i = 0; i < list.size(); ++i) list[i] = elements[static_cast<std::size_t>(i)];
  XmlRpcValue group;
  group["sources"] = list;
  return group;
}

std::vector<std::string> textsOf(const std::vector<ParameterError>& errors) {
  std::vector<std::string> texts;
  for (const ParameterError& error : errors) texts.push_back(error.key + ' ' + error.message);
  return texts;
}

/// Two sources; the second differs in many parameters.
XmlRpcValue twoSources() {
  XmlRpcValue laser = makeSource("laser", "/scan");
  laser["type"] = "laser_scan";
  laser["use"] = "clear";
  laser["max_rate"] = 5;
  laser["sensor_frame"] = "/laser_link";
  laser["sensor_model"]["hit"] = 0.6;
  laser["sensor_model"]["max_range"] = 8.0;
  laser["sensor_model"]["min_range"] = 0.25;
  XmlRpcValue group = listOf({makeSource("lidar", "points"), laser});
  group["sensor_model"]["hit"] = 0.8;
  group["sensor_model"]["miss"] = 0.3;
  group["sensor_model"]["max_range"] = 40.0;
  group["sensor_model"]["min_range"] = 0.5;
  return group;
}

TEST(Sources, WithoutAListThereIsOneOfTheParametersThemselves) {
  NodeParameters parameters;
  parameters.source.max_range_m = 3.0;
  const auto sources = sourcesOf(parameters);
  ASSERT_EQ(sources.size(), 1U);
  EXPECT_EQ(sources[0].max_range_m, 3.0);
  EXPECT_EQ(nameOf(sources[0]), "cloud_in");
}

TEST(Sources, OfAListHaveTheirOwnValuesAndElseThoseOutsideIt) {
  const LoadedParameters loaded = readParameters(twoSources());
  EXPECT_EQ(textsOf(loaded.errors), std::vector<std::string>{});
  const auto sources = sourcesOf(loaded.parameters);
  ASSERT_EQ(sources.size(), 2U);
  EXPECT_EQ(nameOf(sources[0]), "lidar");
  EXPECT_EQ(sources[0].topic, "points");
  EXPECT_EQ(sources[0].type, SourceType::kPointCloud);
  EXPECT_EQ(sources[0].use, SourceUse::kBoth);
  EXPECT_EQ(sources[0].sensor_model.hit, 0.8);
  EXPECT_EQ(sources[0].max_range_m, 40.0);
  EXPECT_EQ(sources[0].min_range_m, 0.5);
  EXPECT_EQ(sources[1].min_range_m, 0.25);
  EXPECT_EQ(sources[1].type, SourceType::kLaserScan);
  EXPECT_EQ(sources[1].use, SourceUse::kClear);
  EXPECT_EQ(sources[1].max_rate_hz, 5.0);
  EXPECT_EQ(sources[1].sensor_frame, "laser_link");
  EXPECT_EQ(sources[1].sensor_model.hit, 0.6);
  EXPECT_EQ(sources[1].sensor_model.miss, 0.3);
  EXPECT_EQ(sources[1].max_range_m, 8.0);
  EXPECT_EQ(loaded.parameters.source.sensor_model.hit, 0.8)
      << "that of the map is as outside the list";
  const auto lines = toSourceLines(loaded.parameters);
  EXPECT_EQ(std::count(lines.begin(), lines.end(),
                       "source laser: sensor_model/hit: 0.6 [probability] (outside the list: 0.8)"),
            1);
}

TEST(Sources, MayWriteKeysWithASlashAsTheirPageDoes) {
  XmlRpcValue element = makeSource("lidar", "points");
  element["sensor_model/max_range"] = 5.0;
  element["ground_filter/angle"] = "steep";
  const LoadedParameters loaded = readParameters(listOf({element}));
  ASSERT_EQ(loaded.errors.size(), 1U);
  EXPECT_EQ(loaded.errors[0].key, "sources[0]/ground_filter/angle");
  EXPECT_EQ(sourcesOf(loaded.parameters).at(0).max_range_m, 5.0);
}

/// The units of the sources, and warnings and errors behind them.
std::string unitsOf(const XmlRpcValue& group) {
  const LoadedParameters loaded = readParameters(group);
  std::string text;
  for (const auto& source : sourcesOf(loaded.parameters)) {
    text += std::to_string(lengthUnitOf(source)).substr(0, 5) + ' ';
  }
  for (const std::string& warning : textsOf(loaded.warnings)) text += "\n? " + warning;
  for (const std::string& error : textsOf(loaded.errors)) text += "\n! " + error;
  return text;
}

TEST(Sources, SayWhatToWriteForAnOldName) {
  XmlRpcValue camera = makeSource("camera", "depth");
  camera["forget_class"] = "free";
  EXPECT_EQ(textsOf(readParameters(listOf({camera})).errors),
            std::vector<std::string>{"sources[0]/forget_class belongs to an earlier version: write "
                                     "forget: all, occupied or free (source camera)"});
}

TEST(Sources, TakeTheOldNamesOfTheUnitForTheTypesThatTheseWereFor) {
  const std::string origin = " (a name of earlier versions, for depth images)";
  const std::string taken = "depth_unit is 0.002 and is used for length_unit" + origin;
  const std::string ignored = "depth_unit is 0.002 and is ignored: length_unit is set" + origin;
  XmlRpcValue group;
  group["depth_unit"] = 0.002;
  EXPECT_EQ(unitsOf(group), "0.000 \n? " + taken) << "the only source has clouds";
  group["type"] = "depth_image";
  EXPECT_EQ(unitsOf(group), "0.002 \n? " + taken);
  group["length_unit"] = 0.002;
  EXPECT_EQ(unitsOf(group), "0.002 \n? " + ignored);
  group["length_unit"] = 1;
  EXPECT_EQ(unitsOf(group), "1.000 \n? " + ignored);
  XmlRpcValue bad;
  bad["depth_unit"] = -0.001;
  EXPECT_NE(unitsOf(bad).find("\n! depth_unit is -0.001"), std::string::npos) << unitsOf(bad);

  XmlRpcValue camera = makeSource("camera", "/depth");
  camera["type"] = "depth_image";
  XmlRpcValue own = camera;
  own["name"] = "own";
  own["depth_unit"] = 0.004;
  XmlRpcValue named = camera;
  named["name"] = "named";
  named["length_unit"] = 0.005;
  group = listOf({makeSource("lidar", "points"), camera, own, named});
  group["depth_unit"] = 0.002;
  const std::string of_own =
      "\n? sources[2]/depth_unit is 0.004 and is used for length_unit" + origin + " (source own)";
  EXPECT_EQ(unitsOf(group), "0.000 0.002 0.004 0.005 \n? " + taken + of_own);
  group["type"] = "depth_image";
  group["sources"][0]["type"] = "point_cloud";
  EXPECT_EQ(unitsOf(group), "0.000 0.002 0.004 0.005 \n? " + taken + of_own);
  group["point_unit"] = 0.01;
  EXPECT_EQ(unitsOf(group).substr(0, 24), "0.010 0.002 0.004 0.005 ");
  group["length_unit"] = 0.5;
  EXPECT_EQ(unitsOf(group).substr(0, 24), "0.500 0.500 0.500 0.005 ");
  EXPECT_NE(unitsOf(group).find("sources[2]/depth_unit is 0.004 and is ignored"),
            std::string::npos);
}

TEST(Sources, EverythingThatIsWrongWithThemIsSaidAtOnce) {
  XmlRpcValue bad = makeSource("laser", "/scan");
  bad["type"] = "lidar";
  bad["sensor_model"]["hit"] = 2.0;
  bad["sensor_model"]["min"] = 0.1;
  bad["max_rat"] = 3;
  bad["sensor_model"]["min_range"] = 50.0;
  bad["sensor_model"]["max_range"] = 20.0;
  XmlRpcValue without_topic;
  without_topic["name"] = "laser";
  XmlRpcValue group = listOf({bad, without_topic, XmlRpcValue(5), makeSource("", "/points")});
  group["resolution"] = -1.0;
  const std::vector<std::string> expected{
      "resolution is -1.0, but must be a number from 0.001 to 100.0: correct it, or remove it to "
      "get the default 0.05",
      "sources[0]/type is \"lidar\", but must be point_cloud, laser_scan or depth_image: choose "
      "one "
      "of the names, or remove it to get the default point_cloud (source laser)",
      "sources[0]/sensor_model/hit is 2.0, but must be a number from 0.501 to 0.999: correct it, "
      "or "
      "remove it to get the default 0.7 (source laser)",
      "sources[0]/sensor_model/min_range is 50.0, but must be less than sensor_model/max_range "
      "(20.0): change one of them (source laser)",
      "sources[0]/max_rat is 3, but a source has no such parameter: did you mean max_rate? Correct "
      "the key, or remove it (source laser)",
      "sources[0]/sensor_model/min concerns the whole map: write it outside the list (source "
      "laser)",
      "sources[1]/topic is missing: name the topic of this source (source laser)",
      "sources[1]/name is that of another source, too: give each source a name of its own (source "
      "laser)",
      "sources[2] is 5, but must be a group of keys (source cloud_in)",
      "sources[3]/name is \"\", but must be a text that is not empty (source /points)"};
  EXPECT_EQ(textsOf(readParameters(group).errors), expected);
  XmlRpcValue no_list;
  no_list["sources"] = "front";
  EXPECT_EQ(readParameters(no_list).errors.at(0).message,
            "is \"front\", but must be a list of groups of keys: begin each source with a dash, or "
            "remove it to get the default []");
}

TEST(Sources, OfAListHaveStepsOfTheirOwn) {
  if (!test::hasParameters({"forget_after", "sensor_model/no_return_points", "filter_ground"})) {
    GTEST_SKIP();
  }
  XmlRpcValue laser = makeSource("laser", "/scan");
  laser["forget_after"] = 3.0;
  laser["sensor_model"]["no_return_points"] = "nan zero";
  laser["filter_ground"] = true;
  const LoadedParameters loaded = readParameters(listOf({makeSource("lidar", "points"), laser}));
  EXPECT_EQ(textsOf(loaded.errors), std::vector<std::string>{});
  const auto sources = sourcesOf(loaded.parameters);
  ASSERT_EQ(sources.size(), 2U);
  EXPECT_EQ(sources[1].forget_after_s, 3.0);
  EXPECT_EQ(sources[0].forget_after_s, 0.0);
  EXPECT_EQ(toText(sources[1].no_return_points), "nan zero");
  EXPECT_TRUE(sources[1].filter_ground);
  EXPECT_FALSE(sources[0].filter_ground);
}

TEST(Sources, StayWhenOtherParametersAreChanged) {
  const LoadedParameters loaded = readParameters(twoSources());
  dynamic_reconfigure::Config request;
  request.doubles.emplace_back();
  request.doubles.back().name = "sensor_model_miss";
  request.doubles.back().value = 0.2;
  const LoadedParameters changed = applyConfig(loaded.parameters, request);
  EXPECT_EQ(textsOf(changed.errors), std::vector<std::string>{});
  const auto sources = sourcesOf(changed.parameters);
  ASSERT_EQ(sources.size(), 2U);
  EXPECT_EQ(sources[1].sensor_model.miss, 0.2) << "what it has not of its own follows";
  EXPECT_EQ(sources[1].sensor_model.hit, 0.6);
}

TEST(Sources, AtMostSoManyMessagesASecondPass) {
  RateLimit limit(10.0);
  int num_passed = 0;
  for (int i = 0; i < 300; ++i) num_passed += limit.allows(ros::Time(1000.0 + i / 30.0)) ? 1 : 0;
  EXPECT_EQ(num_passed, 100);
  EXPECT_TRUE(limit.allows(ros::Time(50.0))) << "a recording has started again";
  EXPECT_FALSE(limit.allows(ros::Time(50.05)));
  EXPECT_TRUE(limit.allows(ros::Time()));
  RateLimit none(0.0);
  EXPECT_TRUE(none.allows(ros::Time(1.0)) && none.allows(ros::Time(1.0)));
}

TEST(Sources, OfTheDocumentAndTheExampleAreTaken) {
  if (!test::hasParameters({"sensor_model/no_return_range", "deskew", "forget_after",
                            "filter_ground", "self_filter/boxes", "moving_points"})) {
    GTEST_SKIP();
  }
  using cuboid_mapping::test::readText;
  const std::string root = std::string(CUBOID_MAPPING_SOURCE_DIR) + '/';
  const std::string page = readText(root + "doc/sensors.md") + readText(root + "doc/clean_maps.md");
  const cuboid_mapping::test::TemporaryFolder folder;
  std::vector<std::string> files{root + "config/sensors.yaml"};
  const std::string fence = "```yaml\n";
  for (auto at = page.find(fence); at != std::string::npos; at = page.find(fence, at + 1)) {
    const std::size_t begin = at + fence.size();
    files.push_back(folder / (std::to_string(files.size()) + ".yaml"));
    std::ofstream(files.back()) << page.substr(begin, page.find("```", begin) - begin);
  }
  EXPECT_GE(files.size(), 6U);
  for (const std::string& file : files) {
    const LoadedParameters loaded = readParameters(loadYamlParameters(file, {}));
    EXPECT_EQ(textsOf(loaded.errors), std::vector<std::string>{}) << file;
    EXPECT_EQ(textsOf(loaded.warnings), std::vector<std::string>{}) << file;
  }
}

/// Class of a voxel after two beams along x from the middle of a voxel, the shorter of which ends on the longer one.
Occupancy classAt(SourceUse use, const cuboid_mapping::Cell& cell, double* log_odds = nullptr) {
  NodeParameters parameters;
  parameters.map.resolution_m = 0.1;
  parameters.source.use = use;
  parameters.source.sensor_model.hit = 0.9;
  Source source(parameters, parameters.source);
  CloudSpec spec;
  spec.width = 2;
  CloudPoses poses;
  poses.T_map_cloud = Eigen::Translation3d(0.05, 0.05, 0.05);
  poses.T_map_sensor = poses.T_map_cloud;
  const Observed observed =
      source.input.compute(makeSensorMessage(spec, {{1.0, 0.0, 0.0}, {2.0, 0.0, 0.0}}), poses);
  const auto* update = observed.update;
  // A map with another hit: the source's hit counts.
  cuboid_mapping::CuboidMap map([] {
    cuboid_mapping::MapConfig config;
    config.resolution_m = 0.1;
    return config;
  }());
  (void)map.apply(*update, source.input.sensorModel());
  if (log_odds != nullptr) *log_odds = map.voxels().logOddsAt(cell).value_or(0.0F);
  return map.voxels().at(cell);
}

TEST(Sources, MarkAndClearAsTheyAreUsed) {
  const auto classes = [](SourceUse use) {
    return std::vector<Occupancy>{classAt(use, {5, 0, 0}), classAt(use, {10, 0, 0}),
                                  classAt(use, {15, 0, 0}), classAt(use, {20, 0, 0})};
  };
  using Classes = std::vector<Occupancy>;
  constexpr auto kFree = Occupancy::kFree;
  constexpr auto kOccupied = Occupancy::kOccupied;
  constexpr auto kUnknown = Occupancy::kUnknown;
  EXPECT_EQ(classes(SourceUse::kBoth), (Classes{kFree, kOccupied, kFree, kOccupied}));
  EXPECT_EQ(classes(SourceUse::kMark), (Classes{kUnknown, kOccupied, kUnknown, kOccupied}));
  EXPECT_EQ(classes(SourceUse::kClear), (Classes{kFree, kUnknown, kFree, kUnknown}))
      << "where a beam ends, another that passes does not clear";
}

TEST(Sources, HitAndMissAreTheirOwn) {
  double log_odds = 0.0;
  EXPECT_EQ(classAt(SourceUse::kBoth, {10, 0, 0}, &log_odds), Occupancy::kOccupied);
  EXPECT_NEAR(log_odds, std::log(0.9 / 0.1), 1e-5);
}

TEST(Sources, AtTheirOwnRateNoMessageIsLostToJitter) {
  for (const double phase_s : {0.0, 0.025, 0.05, 0.075, 0.0999999}) {
    RateLimit limit(10.0);
    int num_passed = 0;
    for (int i = 0; i < 100; ++i) {
      const double jitter_s = i % 2 == 0 ? 1e-6 : -1e-6;
      num_passed += limit.allows(ros::Time(1000.0 + 0.1 * i + phase_s + jitter_s)) ? 1 : 0;
    }
    EXPECT_EQ(num_passed, 100) << phase_s;
  }
}

TEST(Sources, TheSameMessagesPassWhereverARecordingIsStarted) {
  std::set<int> passed[2];
  for (const int first : {0, 14}) {
    RateLimit limit(10.0);
    for (int i = first; i < 300; ++i) {
      if (limit.allows(ros::Time(1000.0 + i / 30.0 + 0.001)) && i > 20) passed[first > 0].insert(i);
    }
  }
  EXPECT_EQ(passed[0], passed[1]);
}

TEST(SourceReport, SaysWhatIsWrongWithOneSource) {
  SourceReport report;
  report.topic = "/scan";
  report.type = "laser_scan";
  report.num_publishers = 1;
  report.statistics.num_received = 3;
  report.statistics.num_inserted = 3;
  const SourceStatistics none;
  EXPECT_EQ(summarize(report, none).level, ReportLevel::kOk);
  EXPECT_EQ(summarize(report, none).message, "3 messages in the map");
  SourceStatistics before = report.statistics;
  report.statistics.num_received = 5;
  EXPECT_EQ(summarize(report, before).level, ReportLevel::kOk);
  before = report.statistics;
  EXPECT_EQ(summarize(report, before).message,
            "2 messages of it wait, and none enters the map: see the log");
  report.statistics.num_inserted = 4;
  report.silence_s = 7.5;
  EXPECT_EQ(summarize(report, none).message,
            "no laser_scan on /scan for 7 s: check the topic and that the sensor is running");
  report.num_publishers = 0;
  report.is_simulated_time = true;
  EXPECT_EQ(summarize(report, none).level, ReportLevel::kOk) << "a bag has ended";
  report.statistics.num_dropped = 1;
  report.statistics.last_drop = "no transform";
  EXPECT_EQ(summarize(report, none).message, "1 message dropped: no transform");
  EXPECT_EQ(summarize(report, report.statistics).level, ReportLevel::kOk) << "that was before";
}

TEST(SourceReport, HasTheNumbersOfOneSource) {
  SourceReport report;
  report.topic = "/scan";
  report.type = "laser_scan";
  report.statistics.num_received = 9;
  report.statistics.num_inserted = 5;
  report.statistics.num_dropped = 3;
  report.statistics.num_ignored = 1;
  diagnostic_updater::DiagnosticStatusWrapper status;
  fillStatus(report, {}, status);
  std::map<std::string, std::string> values;
  for (const auto& value : status.values) values[value.key] = value.value;
  EXPECT_EQ(values["topic"], "/scan");
  EXPECT_EQ(values["type"], "laser_scan");
  EXPECT_EQ(values["messages received"], "9");
  EXPECT_EQ(values["messages inserted"], "5");
  EXPECT_EQ(values["messages dropped"], "3");
  EXPECT_EQ(values["messages ignored, max_rate"], "1");
}

}  // namespace
}  // namespace cuboid_mapping_ros
