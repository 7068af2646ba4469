// SPDX-License-Identifier: BSD-3-Clause
// Parameters that pass through YAML, roslaunch and the parameter server; see
// parameter_server.test.

#include "cuboid_mapping/ros/parameters/parameters.h"
#include "parameter_groups.h"

#include <gtest/gtest.h>
#include <ros/ros.h>

#include <limits>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

TEST(ParameterServer, PaperYamlIsTheMethodOfThePaper) {
  const LoadedParameters loaded = loadParameters(ros::NodeHandle("~paper"));
  EXPECT_EQ(keysOf(loaded.errors), std::vector<std::string>{});
  EXPECT_EQ(loaded.parameters.map.fusion, cuboid_mapping::FusionKind::kGrowth);
  EXPECT_EQ(loaded.parameters.map.environment, cuboid_mapping::Environment::kStatic);
  EXPECT_GT(loaded.parameters.map.beamSampling().per_m, 0.0);
}

TEST(ParameterServer, DemoYamlIsValid) {
  const LoadedParameters loaded = loadParameters(ros::NodeHandle("~demo"));
  EXPECT_EQ(keysOf(loaded.errors), std::vector<std::string>{});
}

TEST(ParameterServer, NoParameterGivesTheDefaults) {
  const LoadedParameters loaded = loadParameters(ros::NodeHandle("~nothing"));
  EXPECT_EQ(keysOf(loaded.errors), std::vector<std::string>{});
  EXPECT_EQ(toLogLines(loaded.parameters), toLogLines(NodeParameters{}));
}

TEST(ParameterServer, ValuesOfALaunchFileArrive) {
  const LoadedParameters loaded = loadParameters(ros::NodeHandle("~good"));
  EXPECT_EQ(keysOf(loaded.errors), std::vector<std::string>{});
  EXPECT_EQ(loaded.parameters.frame_id, "odom");
  EXPECT_EQ(loaded.parameters.map.resolution_m, 1.0);
  EXPECT_EQ(loaded.parameters.source.sensor_model.hit, 0.8);
  EXPECT_EQ(loaded.parameters.queue_size, 24);
  EXPECT_EQ(loaded.parameters.source.max_range_m, std::numeric_limits<double>::infinity());
  EXPECT_EQ(loaded.parameters.source.crop.max_m.z(), 2.5e3);
  EXPECT_TRUE(loaded.parameters.source.keep_surfaces);
}

TEST(ParameterServer, AllErrorsOfALaunchFileAreListed) {
  const LoadedParameters loaded = loadParameters(ros::NodeHandle("~bad"));
  const std::vector<std::string> expected{"resolution",       "sensor_model/hit",
                                          "pointcloud_max_x", "pointcloud_max_z",
                                          "publish_values",   "sensor_model/mis"};
  EXPECT_EQ(keysOf(loaded.errors), expected);
}

TEST(ParameterServer, TheNameOfTheNodeDecidesNothing) {
  const LoadedParameters loaded = loadParameters(ros::NodeHandle("~octomap_server"));
  EXPECT_EQ(keysOf(loaded.errors), std::vector<std::string>{"publish_rat"});
}

}  // namespace
}  // namespace cuboid_mapping_ros

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_parameter_server");
  const ros::NodeHandle handle;
  return RUN_ALL_TESTS();
}
