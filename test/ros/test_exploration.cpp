// SPDX-License-Identifier: BSD-3-Clause
// examples/explore in the simulated building, with nobody touching it: in the end the voxels are known that the robot
// could sweep in the true building, and it has run into nothing.
// Needs the feature planning.
#include "cuboid_mapping/query/point_query.h"
#include "cuboid_mapping/ros/cuboid_map_client.h"
#include "simulation/world.h"

#include <gtest/gtest.h>
#include <ros/ros.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_ros/transform_listener.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::CuboidMap;
using cuboid_mapping::Occupancy;
using cuboid_mapping::Solid;
using cuboid_mapping::World;

// As in launch/explore.launch.
constexpr double kEdge_m = 0.2;
constexpr std::uint64_t kSeed = 1;
constexpr std::array<double, 4> kRegion = {0.2, 0.2, 17.8, 11.8};
constexpr std::array<double, 5> kHeights = {0.3, 0.5, 0.7, 0.9, 1.1};  ///< Of the robot's voxels.

/// Distance to the nearest thing that does not move, over the robot's height.
double computeClearance(const World& world, double x, double y) {
  double clearance = 100.0;
  for (const Solid& solid : world.fixedSolids()) {
    for (const double z : kHeights) {
      clearance = std::min(clearance, computeSignedDistance(solid.shape, {x, y, z}));
    }
  }
  return clearance;
}

/// A column of voxels on the floor.
using Column = std::pair<int, int>;

double centerOf(int index) { return (index + 0.5) * kEdge_m; }

/// The columns that the robot, of 3 x 3 of them, can sweep in the true building.
std::set<Column> findReachable(const World& world, const Column& start) {
  const auto is_free = [&](const Column& column) {
    const double x = centerOf(column.first);
    const double y = centerOf(column.second);
    return x > kRegion[0] && y > kRegion[1] && x < kRegion[2] && y < kRegion[3] &&
           computeClearance(world, x, y) > 0.75 * kEdge_m;
  };
  const auto around = [](const Column& column) {
    std::vector<Column> columns;
    for (int dx : {-1, 0, 1}) {
      for (int dy : {-1, 0, 1}) columns.emplace_back(column.first + dx, column.second + dy);
    }
    return columns;
  };
  std::set<Column> places = {start};
  std::set<Column> swept;
  for (std::vector<Column> open = {start}; !open.empty();) {
    const Column place = open.back();
    open.pop_back();
    const std::vector<Column> body = around(place);
    swept.insert(body.begin(), body.end());
    for (const auto& [dx, dy] : {Column{1, 0}, Column{-1, 0}, Column{0, 1}, Column{0, -1}}) {
      const Column next{place.first + dx, place.second + dy};
      const std::vector<Column> next_body = around(next);
      const bool fits = std::all_of(next_body.begin(), next_body.end(), is_free);
      if (fits && places.insert(next).second) open.push_back(next);
    }
  }
  return swept;
}

bool isExploring() {
  std::vector<std::string> nodes;
  ros::master::getNodes(nodes);
  return std::find(nodes.begin(), nodes.end(), "/explore") != nodes.end();
}

/// Follows the robot until the explorer has come and gone. @return Its least clearance.
double watchExplorer(const World& world) {
  tf2_ros::Buffer transforms;
  const tf2_ros::TransformListener listener(transforms);
  double clearance = 100.0;
  for (int tries = 0; !isExploring() && tries < 600; ++tries) ros::WallDuration(0.1).sleep();
  EXPECT_TRUE(isExploring()) << "the explorer has not started";
  while (ros::ok() && isExploring()) {
    ros::WallDuration(0.05).sleep();
    if (!transforms.canTransform("map", "base_link", ros::Time())) continue;
    const auto place =
        transforms.lookupTransform("map", "base_link", ros::Time()).transform.translation;
    clearance = std::min(clearance, computeClearance(world, place.x, place.y));
  }
  return clearance;
}

/// The voxels of these columns that are unknown.
std::vector<Eigen::Vector3d> findUnknown(const CuboidMap& map, const std::set<Column>& columns) {
  std::vector<Eigen::Vector3d> unknown;
  for (const Column& column : columns) {
    for (const double z : kHeights) {
      const Eigen::Vector3d point(centerOf(column.first), centerOf(column.second), z);
      if (classifyPoint(map, point) == Occupancy::kUnknown) unknown.push_back(point);
    }
  }
  return unknown;
}

TEST(Exploration, leavesNothingUnknownThatTheRobotCouldSweep) {
  ros::AsyncSpinner spinner(1);
  spinner.start();
  const World world(kSeed);
  const Eigen::Vector3d start = world.computeRobotPose(0.0).translation();
  const std::set<Column> reachable = findReachable(
      world, {static_cast<int>(start.x() / kEdge_m), static_cast<int>(start.y() / kEdge_m)});
  // In rooms A, B and C, the hall, at the stairs.
  for (const Column& room :
       {Column{15, 15}, Column{45, 15}, Column{75, 20}, Column{15, 47}, Column{70, 48}}) {
    EXPECT_EQ(reachable.count(room), 1U) << room.first << ' ' << room.second;
  }

  EXPECT_GT(watchExplorer(world), 0.25) << "the robot has run into something";

  const CuboidMapClient client;
  ASSERT_TRUE(client.waitForMap(ros::WallDuration(30.0)));
  const std::vector<Eigen::Vector3d> unknown =
      client.read([&](const CuboidMap& map) { return findUnknown(map, reachable); });
  std::ostringstream points;
  for (const Eigen::Vector3d& point : unknown) points << point.transpose() << '\n';
  const std::size_t num_voxels = reachable.size() * kHeights.size();
  RecordProperty("voxels", static_cast<int>(num_voxels));
  RecordProperty("unknown", static_cast<int>(unknown.size()));
  // Frontiers below ten voxels are not visited. A corner of one square metre is 125 voxels.
  EXPECT_LT(unknown.size(), 100U) << "of " << num_voxels << ":\n" << points.str();
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
