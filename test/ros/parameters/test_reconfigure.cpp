// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/parameters/reconfigure.h"

#include "ros/known_parameters.h"
#include "ros/parameter_groups.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace cuboid_mapping_ros {
namespace {

using dynamic_reconfigure::Config;

Config withNumber(const std::string& name, double value) {
  Config config;
  config.doubles.emplace_back();
  config.doubles.back().name = name;
  config.doubles.back().value = value;
  return config;
}

Config withSwitch(const std::string& name, bool value) {
  Config config;
  config.bools.emplace_back();
  config.bools.back().name = name;
  config.bools.back().value = static_cast<std::uint8_t>(value);
  return config;
}

TEST(Reconfigure, NamesAreKeysWithoutSlashesAndAllDifferent) {
  if (!test::hasAllFeatures()) GTEST_SKIP();
  EXPECT_EQ(toReconfigureName("sensor_model/max_range"), "sensor_model_max_range");
  std::set<std::string> names;
  for (const auto& [key, value] : runtimeValues({})) names.insert(toReconfigureName(key));
  EXPECT_EQ(names.size(), runtimeValues({}).size());
  // Names of octomap_server: a client refuses a request with a name that is not described.
  for (const char* name :
       {"pointcloud_min_z", "pointcloud_max_z", "occupancy_min_z", "occupancy_max_z",
        "filter_speckles", "filter_ground", "ground_filter_distance", "ground_filter_angle",
        "ground_filter_plane_distance", "sensor_model_max_range", "sensor_model_min_range",
        "sensor_model_hit", "sensor_model_miss", "sensor_model_min", "sensor_model_max"}) {
    EXPECT_EQ(names.count(name), 1U) << name;
  }
}

TEST(Reconfigure, WhatIsInForceCanBeSentBackWithoutAnyChange) {
  NodeParameters parameters;
  parameters.source.max_range_m = 20.0;
  parameters.source.use = SourceUse::kMark;
  const LoadedParameters loaded = applyConfig(parameters, toConfig(parameters));
  EXPECT_TRUE(loaded.errors.empty());
  EXPECT_EQ(toLogLines(loaded.parameters), toLogLines(parameters));
}

TEST(Reconfigure, GraphicalClientsGetRangesToDrag) {
  const auto description = describeConfig();
  for (const Config& config : {description.min, description.max}) {
    for (const auto& limit : config.doubles) EXPECT_LE(std::abs(limit.value), 1e4) << limit.name;
  }
}

TEST(Reconfigure, EveryRuntimeParameterIsDescribedWithItsValueAndRange) {
  const auto description = describeConfig();
  ASSERT_EQ(description.groups.size(), 1U);
  const std::size_t num_parameters = runtimeValues({}).size() + 2;  // frame_id, resolution
  EXPECT_EQ(description.groups[0].parameters.size(), num_parameters);
  for (const Config& config : {description.dflt, description.min, description.max}) {
    EXPECT_EQ(config.doubles.size() + config.ints.size() + config.bools.size() + config.strs.size(),
              num_parameters);
    EXPECT_EQ(config.groups.size(), 1U);
  }
  for (std::size_t i = 0; i < description.dflt.doubles.size(); ++i) {
    if (std::abs(description.dflt.doubles[i].value) >= 1e9) continue;  // no limit
    EXPECT_LE(description.min.doubles[i].value, description.dflt.doubles[i].value);
    EXPECT_LE(description.dflt.doubles[i].value, description.max.doubles[i].value)
        << description.dflt.doubles[i].name;
  }
}

TEST(Reconfigure, OneValueChangesAndTheOthersStay) {
  if (!test::hasAllFeatures()) GTEST_SKIP();
  NodeParameters parameters;
  parameters.source.sensor_model.hit = 0.9;
  LoadedParameters loaded = applyConfig(parameters, withNumber("sensor_model_min_range", 1.5));
  EXPECT_TRUE(loaded.errors.empty());
  EXPECT_EQ(loaded.parameters.source.min_range_m, 1.5) << "octomap_server ignores it at run time";
  EXPECT_EQ(loaded.parameters.source.sensor_model.hit, 0.9);
  loaded = applyConfig(parameters, withSwitch("filter_speckles", true));
  EXPECT_EQ(runtimeValues(loaded.parameters)["filter_speckles"], XmlRpcValue(true));
  EXPECT_EQ(loaded.parameters.source.sensor_model.hit, 0.9);
  loaded = applyConfig(parameters, withNumber("pointcloud_max_z", 250.0));
  EXPECT_EQ(loaded.parameters.source.crop.max_m.z(), 250.0) << "not clamped to 100";
}

TEST(Reconfigure, AllFieldsOfARequestCount) {
  if (!test::hasAllFeatures()) GTEST_SKIP();
  Config request = withNumber("sensor_model_max_range", 30.0);
  request.doubles.push_back(withNumber("occupancy_max_z", 2.0).doubles[0]);
  request.bools.push_back(withSwitch("filter_speckles", true).bools[0]);
  const LoadedParameters loaded = applyConfig({}, request);
  EXPECT_TRUE(loaded.errors.empty());
  EXPECT_EQ(loaded.parameters.source.max_range_m, 30.0);
  EXPECT_EQ(runtimeValues(loaded.parameters)["occupancy_max_z"], XmlRpcValue(2.0));
  EXPECT_EQ(runtimeValues(loaded.parameters)["filter_speckles"], XmlRpcValue(true));
}

TEST(Reconfigure, ARequestWithEveryFieldOfOctomapServerCounts) {
  if (!test::hasAllFeatures()) GTEST_SKIP();
  Config request;
  const std::vector<std::pair<std::string, double>> numbers{{"pointcloud_min_z", -50.0},
                                                            {"pointcloud_max_z", 60.0},
                                                            {"occupancy_min_z", -5.0},
                                                            {"occupancy_max_z", 6.0},
                                                            {"ground_filter_distance", 0.05},
                                                            {"ground_filter_angle", 0.2},
                                                            {"sensor_model_max_range", 20.0},
                                                            {"sensor_model_min_range", 0.5},
                                                            {"sensor_model_hit", 0.75},
                                                            {"sensor_model_miss", 0.45},
                                                            {"sensor_model_min", 0.2},
                                                            {"sensor_model_max", 0.9},
                                                            {"ground_filter_plane_distance", 0.1}};
  for (const auto& [name, value] : numbers) {
    request.doubles.push_back(withNumber(name, value).doubles[0]);
  }
  for (const std::string name :
       {"filter_speckles", "filter_ground", "compress_map", "incremental_2D_projection"}) {
    request.bools.push_back(withSwitch(name, name != "compress_map").bools[0]);
  }
  request.ints.resize(1);
  request.ints[0].name = "max_depth";
  request.ints[0].value = 12;
  const LoadedParameters loaded = applyConfig({}, request);
  EXPECT_TRUE(loaded.errors.empty()) << loaded.errors[0].key << ' ' << loaded.errors[0].message;
  const Config in_force = toConfig(loaded.parameters);
  std::size_t num_found = 0;
  for (const auto& number : in_force.doubles) {
    for (const auto& [name, value] : numbers) {
      if (number.name != name) continue;
      EXPECT_EQ(number.value, value) << name;
      ++num_found;
    }
  }
  EXPECT_EQ(num_found, numbers.size());
  EXPECT_EQ(runtimeValues(loaded.parameters)["filter_speckles"], XmlRpcValue(true));
  EXPECT_TRUE(loaded.parameters.source.filter_ground);
}

TEST(Reconfigure, AConflictThatWasThereBeforeRefusesNoChange) {
  if (!test::hasAllFeatures()) GTEST_SKIP();
  NodeParameters parameters =
      readParameters(makeGroup({{"start_free", "-2 -2 0 2 2 1"}})).parameters;
  parameters.map.resolution_m = 0.01;  // Of a map_file: at the start it was another.
  const LoadedParameters loaded = applyConfig(parameters, withNumber("publish_rate", 5.0));
  ASSERT_TRUE(loaded.errors.empty()) << loaded.errors[0].key << ' ' << loaded.errors[0].message;
  EXPECT_EQ(loaded.parameters.publish_rate_hz, 5.0);
}

TEST(Reconfigure, ABadRequestChangesNothingAndSaysWhy) {
  const auto expect_refused = [](const Config& request, const std::string& part) {
    Config with_good = request;
    with_good.doubles.push_back(withNumber("publish_rate", 5.0).doubles[0]);
    const LoadedParameters loaded = applyConfig({}, with_good);
    ASSERT_FALSE(loaded.errors.empty());
    EXPECT_NE(loaded.errors[0].message.find(part), std::string::npos) << loaded.errors[0].message;
    EXPECT_EQ(toLogLines(loaded.parameters), toLogLines({})) << "not even what is good";
  };
  expect_refused(withNumber("resolution", 0.1), "while the node runs");
  Config frame;
  frame.strs.emplace_back();
  frame.strs[0].name = "frame_id";
  frame.strs[0].value = "odom";
  expect_refused(frame, "while the node runs");
  expect_refused(withNumber("sensor_model_hit", 0.3), "from 0.501");
  expect_refused(withNumber("max_deepness", 10), "not a parameter");
  expect_refused(withNumber("pointcloud_min_z", 1e12), "less than");
  Config queue;
  queue.ints.emplace_back();
  queue.ints[0].name = "queue_size";
  queue.ints[0].value = 99;
  expect_refused(queue, "while the node runs");
}

}  // namespace
}  // namespace cuboid_mapping_ros
