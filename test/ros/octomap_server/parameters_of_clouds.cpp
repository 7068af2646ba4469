// SPDX-License-Identifier: BSD-3-Clause
// Effects of octomap_server's parameters for clouds in the running node, with the values
// of octomap_parameters.test.
// Needs the feature ground.
#include "ros/octomap_server/server_node.h"

#include <algorithm>
#include <cmath>

namespace cuboid_mapping_ros::test {
namespace {

using nav_msgs::OccupancyGrid;
using sensor_msgs::PointCloud2;
using visualization_msgs::MarkerArray;

double logOdds(double probability) { return std::log(probability / (1.0 - probability)); }

TEST(PointcloudLimits, LeaveOutWhatIsBeyondEachOfTheSixSides) {
  const Eigen::Vector3d min_m(-1.0, -3.0, -0.5);
  const Eigen::Vector3d max_m(2.0, 4.0, 1.5);
  Points inside;
  Points outside;
  for (int axis = 0; axis < 3; ++axis) {
    inside.push_back(pointAlong(axis, min_m[axis] + 0.15));
    inside.push_back(pointAlong(axis, max_m[axis] - 0.15));
    outside.push_back(pointAlong(axis, min_m[axis] - 0.15));
    outside.push_back(pointAlong(axis, max_m[axis] + 0.15));
  }
  Points all = inside;
  all.insert(all.end(), outside.begin(), outside.end());
  ServerNode limits("limits");
  limits.insert(all);
  EXPECT_EQ(limits.occupied(), cellsOf(inside));
  EXPECT_EQ(limits.free().count({19, 0, 0}), 0U) << "their beams do not count, either";
  ServerNode plain("plain");
  plain.insert(all);
  EXPECT_EQ(plain.occupied(), cellsOf(all));
  EXPECT_EQ(plain.free().count({19, 0, 0}), 1U);
}

TEST(SensorModelRanges, CutLongBeamsAndSkipShortOnes) {
  const Points points{{5.05, 0.05, 0.05}, {0.05, 0.55, 0.05}, {0.05, 0.05, 2.05}};
  ServerNode ranges("ranges");
  ranges.insert(points);
  EXPECT_EQ(ranges.occupied(), cellsOf({points[2]}));
  EXPECT_EQ(ranges.free().count({30, 0, 0}), 1U) << "max_range: free as far as it reaches";
  EXPECT_EQ(ranges.free().count({31, 0, 0}), 0U) << "and no further";
  EXPECT_EQ(ranges.free().count({0, 2, 0}), 0U) << "min_range: not even free";
  ServerNode plain("plain");
  plain.insert(points);
  EXPECT_EQ(plain.occupied(), cellsOf(points));
  EXPECT_EQ(plain.free().count({31, 0, 0}), 1U);
  EXPECT_EQ(plain.free().count({0, 2, 0}), 1U);
}

TEST(SensorModel, SaysHowMuchHitsAndMissesCountAndHowFarTheyAddUp) {
  const auto expect_voxels = [](const ServerNode& node, double hit, double miss) {
    const auto voxels = node.voxels();
    EXPECT_EQ(voxels.size(), 11U);
    EXPECT_NEAR(voxels.at({10, 0, 0}), hit, 1e-5);
    EXPECT_NEAR(voxels.at({5, 0, 0}), miss, 1e-5);
  };
  const Points point{pointAlong(0, 1.05)};
  ServerNode model("model");
  model.insert(point);
  expect_voxels(model, logOdds(0.8), logOdds(0.3));
  model.insert(point);
  expect_voxels(model, logOdds(0.9), logOdds(0.2));  // max and min: less than twice as much
  ServerNode plain("plain");
  plain.insert(point);
  expect_voxels(plain, logOdds(0.7), logOdds(0.4));
  for (int i = 0; i < 9; ++i) plain.insert(point);
  expect_voxels(plain, logOdds(0.97), logOdds(0.12));
}

TEST(FrameAndResolution, AreThoseOfEveryMessage) {
  // The map's origin is at (10, 0, 0) in the frame "odom".
  ServerNode odom("odom");
  odom.insert({pointAlong(0, 1.05)});
  const octomap_msgs::Octomap map = odom.octomap();
  EXPECT_EQ(map.header.frame_id, "odom");
  EXPECT_EQ(map.resolution, 0.25);
  EXPECT_EQ(odom.occupied(), (std::set<Cell>{{44, 0, 0}}));
  EXPECT_EQ(odom.show<octomap_msgs::Octomap>("octomap_full").header.frame_id, "odom");
  EXPECT_EQ(odom.show<octomap_msgs::Octomap>("octomap_binary").header.frame_id, "odom");
  const auto centers = odom.show<PointCloud2>("octomap_point_cloud_centers");
  EXPECT_EQ(centers.header.frame_id, "odom");
  EXPECT_EQ(cellsOf(pointsOf(centers), 0.25), odom.occupied());
  const auto grid = odom.show<OccupancyGrid>("projected_map");
  EXPECT_EQ(grid.header.frame_id, "odom");
  EXPECT_EQ(grid.info.resolution, 0.25F);
  EXPECT_EQ(cellsOf(grid, 100), odom.occupied());
  for (const auto& marker : odom.show<MarkerArray>("occupied_cells_vis_array").markers) {
    EXPECT_EQ(marker.header.frame_id, "odom");
    EXPECT_EQ(marker.scale.x, std::ldexp(0.25, 16 - marker.id));
  }
}

/// Points of a floor in front of the lidar. @param height_base  Height of a place above z = 0 of "robot",
/// which is 1 m below the lidar.
template <typename FunctionT>
Points makeFloor(double max_x_m, FunctionT height_base) {
  Points points;
  int count = 0;
  for (double x = 1.025; x < max_x_m; x += 0.05) {
    for (double y = -0.975; y < 1.0; y += 0.05) {
      points.emplace_back(x, y, -0.95 + height_base(x, ++count));
    }
  }
  return points;
}

TEST(GroundFilter, TakesTheFloorForFreeSpaceInTheFrameOfTheBase) {
  Points points = makeFloor(3.0, [](double, int) { return 0.0; });
  Points wall;
  for (double z = -0.45; z < 0.5; z += 0.1) wall.emplace_back(3.25, 0.05, z);
  points.insert(points.end(), wall.begin(), wall.end());
  ServerNode ground("ground");
  ground.insert(points);
  EXPECT_EQ(ground.occupied(), cellsOf(wall));
  EXPECT_EQ(ground.free().count({15, 0, -9}), 1U) << "the space before the floor is free";
  ServerNode plain("plain");
  plain.insert(points);
  EXPECT_EQ(plain.occupied(), cellsOf(points));
}

TEST(GroundFilter, IsAsRoughSteepAndFarFromTheBaseAsTheParametersAllow) {
  struct Floor {
    const char* parameter;
    Points points;
  };
  const std::vector<Floor> floors{
      {"ground_filter/distance",
       makeFloor(3.0, [](double, int i) { return i % 5 == 0 ? 0.2 : 0.0; })},
      {"ground_filter/angle", makeFloor(6.0, [](double x, int) { return x * std::tan(0.3); })},
      {"ground_filter/plane_distance", makeFloor(3.0, [](double, int) { return 0.3; })}};
  ServerNode ground("ground");
  ServerNode rough("rough_ground");
  for (const Floor& floor : floors) {
    rough.reset();
    rough.insert(floor.points);
    EXPECT_EQ(rough.occupied().size(), 0U) << floor.parameter;
    EXPECT_GT(rough.free().size(), 1000U) << floor.parameter;
    ground.reset();
    ground.insert(floor.points);
    EXPECT_GT(ground.occupied().size(), 100U) << floor.parameter << ", by default";
  }
}

/// Names that octomap_server reads; for map_file, see node_octomap_server.cpp.
TEST(OctomapParameters, AreAllSetSomewhere) {
  std::vector<std::string> keys{"frame_id",           "base_frame_id",
                                "resolution",         "height_map",
                                "colored_map",        "color_factor",
                                "publish_free_space", "latch",
                                "min_x_size",         "min_y_size",
                                "filter_speckles",    "filter_ground",
                                "compress_map",       "incremental_2D_projection",
                                "occupancy_min_z",    "occupancy_max_z"};
  for (const std::string limit : {"min", "max"}) {
    for (const std::string axis : {"x", "y", "z"}) {
      keys.push_back(std::string("pointcloud_").append(limit).append("_").append(axis));
    }
  }
  for (const std::string channel : {"r", "g", "b", "a"}) {
    keys.push_back("color/" + channel);
    keys.push_back("color_free/" + channel);
  }
  for (const std::string name : {"hit", "miss", "min", "max", "min_range", "max_range"}) {
    keys.push_back("sensor_model/" + name);
  }
  for (const std::string name : {"distance", "angle", "plane_distance"}) {
    keys.push_back("ground_filter/" + name);
  }
  EXPECT_EQ(keys.size(), 39U);
  std::vector<std::string> names;
  ASSERT_TRUE(ros::param::getParamNames(names));
  for (const std::string& key : keys) {
    const std::string end = "/octomap_server/" + key;
    EXPECT_TRUE(std::any_of(names.begin(), names.end(), [&end](const std::string& name) {
      return name.size() > end.size() && name.substr(name.size() - end.size()) == end;
    })) << key;
  }
}

}  // namespace
}  // namespace cuboid_mapping_ros::test

int main(int argc, char** argv) {
  using cuboid_mapping_ros::test::makeTransform;
  using cuboid_mapping_ros::test::makeTranslation;
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_octomap_parameters");
  const ros::NodeHandle keeps_ros_running;
  const auto T_map_lidar =
      Eigen::Isometry3d(Eigen::Translation3d(cuboid_mapping_ros::test::kOriginOfLidar));
  for (const auto& transform :
       {makeTransform("odom", "map", makeTranslation(10.0, 0.0, 0.0)),
        makeTransform("map", "lidar", T_map_lidar),
        makeTransform("map", "robot", makeTranslation(0.0, 0.0, -0.95)),
        makeTransform("map", "base_footprint", makeTranslation(0.0, 0.0, 5.0))}) {
    cuboid_mapping_ros::test::publishStaticTf(transform);
  }
  return RUN_ALL_TESTS();
}
