// SPDX-License-Identifier: BSD-3-Clause
// Parameters that the node does not have: of octomap_server, of earlier versions, of other nodes, and misspelt ones.
#include "cuboid_mapping/ros/parameters/parameter_table.h"
#include "cuboid_mapping/ros/parameters/parameters.h"
#include "ros/known_parameters.h"
#include "ros/parameter_groups.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

TEST(UnknownParameters, AllThatOctomapServerHasAreTaken) {
  if (!test::hasAllFeatures()) GTEST_SKIP();
  const XmlRpcValue theirs = makeGroup({{"frame_id", "map"},
                                        {"base_frame_id", "base_footprint"},
                                        {"resolution", 0.05},
                                        {"height_map", true},
                                        {"colored_map", false},
                                        {"color_factor", 0.8},
                                        {"color/r", 0.0},
                                        {"color/g", 0.0},
                                        {"color/b", 1.0},
                                        {"color/a", 1.0},
                                        {"color_free/r", 0.0},
                                        {"color_free/g", 1.0},
                                        {"color_free/b", 0.0},
                                        {"color_free/a", 1.0},
                                        {"publish_free_space", false},
                                        {"latch", true},
                                        {"pointcloud_min_x", -100.0},
                                        {"pointcloud_max_x", 100.0},
                                        {"pointcloud_min_y", -100.0},
                                        {"pointcloud_max_y", 100.0},
                                        {"pointcloud_min_z", -100.0},
                                        {"pointcloud_max_z", 100.0},
                                        {"occupancy_min_z", -100.0},
                                        {"occupancy_max_z", 100.0},
                                        {"min_x_size", 0.0},
                                        {"min_y_size", 0.0},
                                        {"filter_speckles", false},
                                        {"filter_ground", false},
                                        {"ground_filter/distance", 0.04},
                                        {"ground_filter/angle", 0.15},
                                        {"ground_filter/plane_distance", 0.07},
                                        {"sensor_model/max_range", -1.0},
                                        {"sensor_model/min_range", -1.0},
                                        {"sensor_model/hit", 0.7},
                                        {"sensor_model/miss", 0.4},
                                        {"sensor_model/min", 0.12},
                                        {"sensor_model/max", 0.97},
                                        {"compress_map", true},
                                        {"incremental_2D_projection", false},
                                        {"map_file", ""}});
  EXPECT_TRUE(readParameters(theirs).errors.empty());
}

TEST(UnknownParameters, AnUnknownKeyIsRefusedWithTheNearestKnownOne) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {"resolutoin", "resolution"},
      {"Resolution", "resolution"},
      {"frameid", "frame_id"},
      {"max_range", "sensor_model/max_range"},
      {"sensor_model/max_rang", "sensor_model/max_range"},
      {"sensor_modl/hit", "sensor_model/hit"},
      {"sensor_model_mis", "sensor_model/miss"},
      {"pointcloud_max_zz", "pointcloud_max_z"},
      {"max_sensor_range", "sensor_model/max_range"},
  };
  for (const auto& [key, nearest] : cases) {
    const LoadedParameters loaded = readParameters(makeGroup({{key, 0.5}}));
    ASSERT_EQ(keysOf(loaded.errors), std::vector<std::string>{key});
    EXPECT_EQ(loaded.errors[0].message, "is 0.5, but there is no such parameter: did you mean " +
                                            nearest + "? Correct the key, or remove it");
  }
}

TEST(UnknownParameters, NothingIsSuggestedForAKeyThatIsLikeNoOther) {
  for (const char* key : {"my_own_name", "growth/model", "x"}) {
    const LoadedParameters loaded = readParameters(makeGroup({{key, 3}}));
    ASSERT_EQ(keysOf(loaded.errors), std::vector<std::string>{key});
    EXPECT_EQ(loaded.errors[0].message,
              "is 3, but there is no such parameter. Correct the key, or remove it");
  }
}

TEST(UnknownParameters, WhatIsOfAnEarlierVersionIsRefusedWithWhatToDo) {
  const auto errors_of = [](const std::string& key, const XmlRpcValue& value) {
    return readParameters(makeGroup({{key, value}})).errors;
  };
  const auto of_bricks = errors_of("hot_bricks", 64);
  ASSERT_EQ(keysOf(of_bricks), std::vector<std::string>{"hot_bricks"});
  EXPECT_EQ(of_bricks[0].message,
            "belongs to an earlier version: there is nothing to limit any more: remove it");
  const auto of_cuboids = errors_of("published_cuboids", "class");
  ASSERT_EQ(keysOf(of_cuboids), std::vector<std::string>{"published_cuboids"});
  EXPECT_TRUE(hasText(of_cuboids[0], "boxes of one class: remove it")) << of_cuboids[0].message;
  const auto of_forgetting = errors_of("forget_class", "occupied");
  ASSERT_EQ(keysOf(of_forgetting), std::vector<std::string>{"forget_class"});
  EXPECT_TRUE(hasText(of_forgetting[0], "write forget: ")) << of_forgetting[0].message;
  for (const auto& [key, cure] : retiredParameters()) {
    EXPECT_EQ(keysOf(errors_of(key, 1)), std::vector<std::string>{key}) << cure;
  }
  const auto of_fusion = errors_of("fusion", "brick");
  ASSERT_EQ(keysOf(of_fusion), std::vector<std::string>{"fusion"});
  EXPECT_TRUE(hasText(of_fusion[0], "write class")) << of_fusion[0].message;
}

TEST(UnknownParameters, ThoseOfNodeletAndDiagnosticUpdaterAreTheirs) {
  const LoadedParameters loaded =
      readParameters(makeGroup({{"num_worker_threads", 2}, {"diagnostic_period", "x"}}));
  EXPECT_TRUE(loaded.errors.empty() && loaded.warnings.empty());
}

/// Parameters that dynamic_reconfigure of octomap_server 0.6.7 leaves, with its defaults.
XmlRpcValue leftoversOfOctomapServer() {
  return makeGroup({{"max_depth", 16},
                    {"pointcloud_min_z", -100.0},
                    {"pointcloud_max_z", 100.0},
                    {"occupancy_min_z", -100.0},
                    {"occupancy_max_z", 100.0},
                    {"filter_speckles", false},
                    {"filter_ground", false},
                    {"ground_filter_distance", 0.04},
                    {"ground_filter_angle", 0.15},
                    {"ground_filter_plane_distance", 0.07},
                    {"compress_map", true},
                    {"incremental_2D_projection", false},
                    {"sensor_model_max_range", -1.0},
                    {"sensor_model_min_range", -1.0},
                    {"sensor_model_hit", 0.7},
                    {"sensor_model_miss", 0.4},
                    {"sensor_model_min", 0.12},
                    {"sensor_model_max", 0.97}});
}

TEST(UnknownParameters, LeftoversOfOctomapServerAreTakenWithAWarning) {
  if (!test::hasAllFeatures()) GTEST_SKIP();
  XmlRpcValue values = leftoversOfOctomapServer();
  const LoadedParameters defaults = readParameters(values);
  EXPECT_TRUE(defaults.errors.empty());
  EXPECT_EQ(defaults.warnings.size(), 12U) << "three of them have no effect";

  set(values, "sensor_model_max_range", 20.0);
  set(values, "sensor_model_hit", 0.8);
  set(values, "sensor_model/hit", 0.6);
  set(values, "sensor_model_miss", 0.9);
  const LoadedParameters loaded = readParameters(values);
  EXPECT_TRUE(loaded.errors.empty());
  EXPECT_EQ(loaded.parameters.source.max_range_m, 20.0);
  EXPECT_EQ(loaded.parameters.source.sensor_model.hit, 0.6)
      << "what is written with a slash counts";
  EXPECT_EQ(loaded.parameters.source.sensor_model.miss, 0.4) << "a bad leftover does no harm";
  EXPECT_NE(warningOf(loaded, "sensor_model_max_range")
                .find("is 20.0 and is used for sensor_model/max_range"),
            std::string::npos);
  EXPECT_NE(warningOf(loaded, "sensor_model_hit").find("ignored: sensor_model/hit is set"),
            std::string::npos);
  EXPECT_NE(warningOf(loaded, "sensor_model_miss").find("must be a number from 0.001 to 0.499"),
            std::string::npos);
}

TEST(UnknownParameters, UnknownKeysAreWarningsWhereTheParametersSaySo) {
  XmlRpcValue values = makeGroup({{"resolutoin", 0.2}, {"sensor_model/x", "x"}});
  EXPECT_EQ(readParameters(values).errors.size(), 2U);
  values["ignore_unknown"] = true;
  const LoadedParameters loaded = readParameters(values);
  EXPECT_EQ(keysOf(loaded.errors), std::vector<std::string>{});
  EXPECT_EQ(warningOf(loaded, "resolutoin"),
            "is 0.2, but there is no such parameter: did you mean resolution? It is ignored");
  EXPECT_EQ(warningOf(loaded, "sensor_model/x").find("is \"x\", but"), 0U);
}

TEST(UnknownParameters, OfOtherNodesWithinTheNameOfTheNodeDoNoHarm) {
  const LoadedParameters loaded = readParameters(makeGroup({{"cuboid_mapping/resolution", 0.2},
                                                            {"cuboid_mapping/publish_rate", 2.0},
                                                            {"camera/model", "x"},
                                                            {"resolution", 0.1}}));
  EXPECT_EQ(keysOf(loaded.errors), std::vector<std::string>{});
  EXPECT_EQ(keysOf(loaded.warnings), (std::vector<std::string>{"camera", "cuboid_mapping"}));
  EXPECT_EQ(
      warningOf(loaded, "cuboid_mapping"),
      "is a group of keys that this node does not have: taken for another node's, and ignored. "
      "This node's keys have no name above them");
  EXPECT_EQ(loaded.parameters.map.resolution_m, 0.1);
}

TEST(UnknownParameters, NamesThatOnlyOctomapServerHasAreIgnored) {
  for (const char* key :
       {"track_changes", "listen_changes", "topic_changes", "change_id_frame", "min_change_pub",
        "compress_map", "incremental_2D_projection", "max_depth", "colored_map"}) {
    const LoadedParameters loaded = readParameters(makeGroup({{key, 1}}));
    EXPECT_TRUE(loaded.errors.empty()) << key;
    EXPECT_EQ(warningOf(loaded, key).find("is 1 and is ignored: "), 0U) << key;
  }
}

}  // namespace
}  // namespace cuboid_mapping_ros
