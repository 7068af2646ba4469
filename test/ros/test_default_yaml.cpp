// SPDX-License-Identifier: BSD-3-Clause
// config/default.yaml, which has the parameters of all features; see parameter_server.test.
// Needs the features corrections, deskew, files, fleet, forgetting, grids, ground, moving_points, no_returns, octomap_server, self_filter, sharing, start, window.

#include "cuboid_mapping/ros/parameters/parameters.h"
#include "parameter_groups.h"

#include <gtest/gtest.h>
#include <ros/node_handle.h>

#include <string>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

TEST(ParameterServer, DefaultYamlHoldsTheDefaults) {
  const ros::NodeHandle handle("~default");
  ASSERT_TRUE(handle.hasParam("sensor_model/max_range")) << "config/default.yaml is not loaded";
  const LoadedParameters loaded = loadParameters(handle);
  EXPECT_EQ(keysOf(loaded.errors), std::vector<std::string>{});
  EXPECT_EQ(toLogLines(loaded.parameters), toLogLines(NodeParameters{}));
}

}  // namespace
}  // namespace cuboid_mapping_ros
