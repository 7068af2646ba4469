// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/parameters/parameters.h"

#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include "parameter_pages.h"
#include "ros/keep_cases.h"
#include "ros/known_parameters.h"
#include "ros/parameter_cases.h"
#include "ros/parameter_groups.h"
#include "ros/window_cases.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

std::string sourceText(const std::string& path) {
  std::ifstream in(std::string(CUBOID_MAPPING_SOURCE_DIR) + '/' + path);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

std::vector<Case> allCases() {
  std::vector<Case> cases = mapCases();
  for (const auto& part :
       {fusionCases(), sourceCases(), selfFilterCases(), sensorModelCases(), fleetCases(),
        windowCases(), keepCases(), limitCases(), otherCases(), octomapServerCases()}) {
    cases.insert(cases.end(), part.begin(), part.end());
  }
  const auto is_gone = [](const Case& c) { return !test::hasParameters({c.key}); };
  cases.erase(std::remove_if(cases.begin(), cases.end(), is_gone), cases.end());
  return cases;
}

TEST(Parameters, NoneGivesTheDefaultsWithoutError) {
  // `nodelet load` leaves an empty string if there is no parameter.
  for (const XmlRpcValue& none : {XmlRpcValue(), XmlRpcValue(""), makeGroup({})}) {
    const LoadedParameters loaded = readParameters(none);
    EXPECT_TRUE(loaded.errors.empty());
    EXPECT_EQ(toLogLines(loaded.parameters), toLogLines(NodeParameters{}));
  }
}

TEST(Parameters, EveryParameterHasACaseInThisTest) {
  const std::vector<std::string> lines = toLogLines({});
  EXPECT_EQ(lines.size(), allCases().size());
  for (const Case& c : allCases()) {
    const auto is_own = [&c](const std::string& line) { return line.rfind(c.key + ": ", 0) == 0; };
    EXPECT_EQ(std::count_if(lines.begin(), lines.end(), is_own), 1) << c.key;
  }
}

TEST(Parameters, EveryGoodValueArrivesInItsFieldAndInTheLog) {
  const std::vector<std::string> defaults = toLogLines({});
  for (const Case& c : allCases()) {
    SCOPED_TRACE(c.key);
    EXPECT_FALSE(c.arrives && c.arrives(NodeParameters{}))
        << "the case does not differ from the default";
    const LoadedParameters loaded = readParameters(makeGroup({{c.key, c.good}}));
    // A frame of the window is not enough: see test_window_answers.cpp.
    EXPECT_EQ(keysOf(loaded.errors),
              std::vector<std::string>(c.key == "window/frame" ? 1 : 0, "window/file"));
    EXPECT_TRUE(!c.arrives || c.arrives(loaded.parameters));
    const std::vector<std::string> lines = toLogLines(loaded.parameters);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const bool is_own = lines[i].rfind(c.key + ": ", 0) == 0;
      EXPECT_EQ(lines[i] != defaults[i], is_own) << lines[i];
      EXPECT_EQ(lines[i].find("(default)") == std::string::npos, is_own) << lines[i];
    }
  }
}

TEST(Parameters, EveryBadValueGivesExactlyItsErrorAndKeepsTheDefault) {
  std::size_t num_checked = 0;
  for (const Case& c : allCases()) {
    for (const XmlRpcValue& bad : c.bad) {
      SCOPED_TRACE(c.key + " " + bad.toXml());
      const LoadedParameters loaded = readParameters(makeGroup({{c.key, bad}}));
      EXPECT_EQ(keysOf(loaded.errors), std::vector<std::string>{c.key});
      if (loaded.errors.empty()) continue;
      EXPECT_TRUE(hasText(loaded.errors[0], "but must be ")) << loaded.errors[0].message;
      EXPECT_TRUE(hasText(loaded.errors[0], "the default ")) << loaded.errors[0].message;
      EXPECT_EQ(toLogLines(loaded.parameters), toLogLines({}));
      ++num_checked;
    }
  }
  EXPECT_GT(num_checked, 3 * allCases().size());
}

TEST(Parameters, AnErrorSaysValueRangeAndWhatToDo) {
  const auto message_of = [](const std::string& key, const XmlRpcValue& value) {
    return readParameters(makeGroup({{key, value}})).errors.at(0).message;
  };
  EXPECT_EQ(message_of("sensor_model/hit", 1.7),
            "is 1.7, but must be a number from 0.501 to 0.999: correct it, or remove it to get the "
            "default 0.7");
  EXPECT_EQ(message_of("pointcloud_max_z", "1e9"),
            "is \"1e9\", but must be a number: write it without quotes, an exponent as in 1.0e+9, "
            "or remove it to get the default 1.0e+09");
  EXPECT_EQ(message_of("fusion", "bricks"),
            "is \"bricks\", but must be class, growth or none: choose one of the names, or "
            "remove it to get the default class");
  EXPECT_EQ(message_of("sensor_model/max_range", 0),
            "is 0, but must be -1, or a number of at least 0.01: correct it, or remove it to get "
            "the default -1.0");
}

TEST(Parameters, AWholeNumberIsTakenForANumber) {
  const LoadedParameters loaded =
      readParameters(makeGroup({{"publish_rate", 2}, {"sensor_model/max_range", 80}}));
  EXPECT_TRUE(loaded.errors.empty());
  EXPECT_EQ(loaded.parameters.publish_rate_hz, 2.0);
  EXPECT_EQ(loaded.parameters.source.max_range_m, 80.0);
}

TEST(Parameters, MinusOneMeansNoRangeLimitAsWithOctomapServer) {
  for (const XmlRpcValue& minus_one : {XmlRpcValue(-1), XmlRpcValue(-1.0)}) {
    const LoadedParameters loaded = readParameters(
        makeGroup({{"sensor_model/max_range", minus_one}, {"sensor_model/min_range", minus_one}}));
    EXPECT_TRUE(loaded.errors.empty());
    EXPECT_EQ(loaded.parameters.source.max_range_m, kInfinity);
    EXPECT_EQ(loaded.parameters.source.min_range_m, 0.0);
  }
}

TEST(Parameters, DefaultsHoldWhereNothingElseIsSet) {
  const LoadedParameters loaded =
      readParameters(makeGroup({{"resolution", 0.3},
                                {"sensor_model/max_range", 7.0},
                                {"defaults/resolution", 0.1},
                                {"defaults/frame_id", "site"},
                                {"defaults/sensor_model/min_range", 0.5},
                                {"defaults/sensor_model/max_range", 30.0}}));
  EXPECT_TRUE(loaded.errors.empty() && loaded.warnings.empty());
  EXPECT_EQ(loaded.parameters.map.resolution_m, 0.3);
  EXPECT_EQ(loaded.parameters.frame_id, "site");
  EXPECT_EQ(loaded.parameters.source.min_range_m, 0.5);
  EXPECT_EQ(loaded.parameters.source.max_range_m, 7.0);
  const LoadedParameters wrong = readParameters(makeGroup({{"defaults/resolutoin", 0.3}}));
  EXPECT_EQ(keysOf(wrong.errors), std::vector<std::string>{"resolutoin"});
  for (const XmlRpcValue& no_group : {XmlRpcValue(3), XmlRpcValue("x"), makeList()}) {
    const LoadedParameters none = readParameters(makeGroup({{"defaults", no_group}}));
    ASSERT_EQ(keysOf(none.errors), std::vector<std::string>{"defaults"});
    EXPECT_TRUE(hasText(none.errors[0], "but must be a group of keys")) << none.errors[0].message;
  }
  XmlRpcValue empty;
  (void)empty.begin();
  EXPECT_TRUE(readParameters(makeGroup({{"defaults", empty}})).errors.empty());
}

TEST(Parameters, SetsThatDoNotFitAreRefused) {
  using Values = std::vector<std::pair<std::string, XmlRpcValue>>;
  const std::vector<std::pair<Values, std::string>> cases{
      {{{"pointcloud_min_x", 1.0}, {"pointcloud_max_x", 1.0}}, "pointcloud_min_x"},
      {{{"pointcloud_min_y", 2.0}, {"pointcloud_max_y", 1.0}}, "pointcloud_min_y"},
      {{{"pointcloud_max_z", -2e9}}, "pointcloud_min_z"},
      {{{"sensor_model/min_range", 5.0}, {"sensor_model/max_range", 5.0}},
       "sensor_model/min_range"},
  };
  for (const auto& [values, key] : cases) {
    const LoadedParameters loaded = readParameters(makeGroup(values));
    EXPECT_EQ(keysOf(loaded.errors), std::vector<std::string>{key});
  }
  EXPECT_EQ(readParameters(makeGroup({{"pointcloud_min_y", 2}, {"pointcloud_max_y", 1.5}}))
                .errors.at(0)
                .message,
            "is 2.0, but must be less than pointcloud_max_y (1.5): change one of them");
}

TEST(Parameters, SetsAreNotJudgedByAValueThatIsBadItself) {
  const LoadedParameters loaded =
      readParameters(makeGroup({{"pointcloud_max_x", "1"}, {"pointcloud_min_x", 2e9}}));
  EXPECT_EQ(keysOf(loaded.errors), std::vector<std::string>{"pointcloud_max_x"});
}

TEST(Parameters, AllErrorsAreListedAtOnce) {
  const LoadedParameters loaded = readParameters(makeGroup({{"resolution", 0.0},
                                                            {"frame_id", ""},
                                                            {"sensor_model/hit", 2.0},
                                                            {"publish_rate", "yes"},
                                                            {"pointcloud_min_x", kNan},
                                                            {"pointcloud_min_z", 3.0},
                                                            {"pointcloud_max_z", 1.0},
                                                            {"sensor_model/hitt", 0.7},
                                                            {"publish_rates", 1.0}}));
  const std::vector<std::string> expected{
      "frame_id",     "resolution",       "sensor_model/hit", "pointcloud_min_x",
      "publish_rate", "pointcloud_min_z", "publish_rates",    "sensor_model/hitt"};
  EXPECT_EQ(keysOf(loaded.errors), expected);
}

TEST(Parameters, TheLogSaysWhatDiffers) {
  NodeParameters parameters;
  EXPECT_TRUE(toDifferenceLines(parameters, {}, "default").empty());
  parameters.source.max_range_m = 50.0;
  parameters.map.resolution_m = 0.2;
  const std::vector<std::string> expected{"resolution: 0.2 [m] (default: 0.05)",
                                          "sensor_model/max_range: 50.0 [m] (default: -1.0)"};
  EXPECT_EQ(toDifferenceLines(parameters, {}, "default"), expected);
  EXPECT_EQ(toDifferenceLines({}, parameters, "was").front(), "resolution: 0.05 [m] (was: 0.2)");
}

TEST(Parameters, AFrameLosesItsSlashWithAWarning) {
  if (!test::hasAllFeatures()) GTEST_SKIP();
  const LoadedParameters loaded = readParameters(
      makeGroup({{"frame_id", "/map"}, {"base_frame_id", "/base"}, {"sensor_frame", "lidar"}}));
  EXPECT_TRUE(loaded.errors.empty());
  EXPECT_EQ(loaded.parameters.frame_id, "map");
  EXPECT_EQ(loaded.parameters.base_frame_id, "base");
  EXPECT_EQ(loaded.warnings.size(), 2U);
  EXPECT_EQ(warningOf(loaded, "frame_id"),
            "is \"/map\" and is read as \"map\": tf2 frames have no slash at the start");
}

TEST(Parameters, GroupsAndValuesAreNotMixedUp) {
  EXPECT_EQ(keysOf(readParameters(makeGroup({{"sensor_model", 0.7}})).errors),
            std::vector<std::string>{"sensor_model"});
  const LoadedParameters group_for_value = readParameters(makeGroup({{"resolution/x", 0.1}}));
  ASSERT_EQ(keysOf(group_for_value.errors), std::vector<std::string>{"resolution"});
  EXPECT_TRUE(hasText(group_for_value.errors[0], "is a group of keys, but must be a number"));
  EXPECT_EQ(keysOf(readParameters(XmlRpcValue(5)).errors), std::vector<std::string>{"~"});
  EXPECT_EQ(keysOf(readParameters(makeList()).errors), std::vector<std::string>{"~"});
}

TEST(Parameters, DefaultYamlIsWhatPrintParametersWrites) {
  if (!test::hasAllFeatures()) GTEST_SKIP();
  EXPECT_EQ(sourceText("config/default.yaml"), toYaml()) << "Write it anew: scripts/reference";
}

TEST(Parameters, TheDocumentIsWhatPrintParametersWrites) {
  if (!test::hasAllFeatures()) GTEST_SKIP();
  EXPECT_EQ(sourceText("doc/parameters.md"), toMarkdownTable())
      << "Write it anew: scripts/reference";
}

TEST(Parameters, TheDocumentHasOneRowForEachParameter) {
  std::istringstream lines(toMarkdownTable());
  std::size_t num_rows = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("| `", 0) != 0 && line.rfind("| **`", 0) != 0) continue;
    ++num_rows;
    EXPECT_EQ(std::count(line.begin(), line.end(), '|'), 5) << line;
  }
  EXPECT_EQ(num_rows, allCases().size());
}

TEST(Parameters, TheDocumentBeginsWithTenAndHasEachInItsGroup) {
  const std::string page = toMarkdownTable();
  const std::map<std::string, std::vector<std::string>> groups = {
      {"The first ten", {"resolution", "sources", "deskew"}},
      {"Sensor", {"type", "ground_filter/angle", "self_filter/padding", "sensor_model/hit"}},
      {"Map", {"fusion", "sensor_model/min", "window/size", "map_file"}},
      {"Output", {"publish_rate", "occupancy_min_z", "robot_grid/size"}},
      {"Advanced", {"threads", "query/max_time", "tf_gap"}}};
  for (const auto& [head, keys] : groups) {
    const std::size_t start = page.find("\n## " + head + "\n");
    ASSERT_NE(start, std::string::npos) << head;
    const std::string section = page.substr(start, page.find("\n## ", start + 1) - start);
    if (head == "The first ten" && test::hasParameters({"deskew", "self_filter/robot_description",
                                                        "forget_after", "autosave_file"})) {
      EXPECT_EQ(std::count(section.begin(), section.end(), '\n'), 5 + 10);
    }
    for (const auto& key : keys) {
      if (!test::hasParameters({key})) continue;
      EXPECT_NE(section.find('`' + key + '`'), std::string::npos) << key;
    }
  }
  EXPECT_NE(page.find("| **`resolution`** |"), std::string::npos) << "a name of octomap_server";
  EXPECT_NE(page.find("| `fusion` |"), std::string::npos) << "a name of this node";
}

}  // namespace
}  // namespace cuboid_mapping_ros
