// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/grids/robot_grid_feature.h"
#include "ros/parameter_groups.h"

#include <gtest/gtest.h>

namespace cuboid_mapping_ros {
namespace {

TEST(RobotGridParameters, Arrive) {
  const auto read = readInto<RobotGridParameters>({{"robot_grid/frame", "base_link"},
                                                   {"robot_grid/size", 8.0},
                                                   {"robot_grid/min_z", -0.5},
                                                   {"robot_grid/max_z", 2.5}});
  EXPECT_EQ(read.frame_id, "base_link");
  EXPECT_EQ(read.size_m, 8.0);
  EXPECT_EQ(read.min_z_m, -0.5);
  EXPECT_EQ(read.max_z_m, 2.5);
}

}  // namespace
}  // namespace cuboid_mapping_ros
