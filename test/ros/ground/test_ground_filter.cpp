// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/ground/ground_step.h"

#include "cuboid_mapping/ros/mapping/sensor_input.h"
#include "cuboid_mapping/rtree/traversal.h"
#include "ros/cloud_messages.h"
#include "ros/node_probe.h"
#include "ros/parameter_groups.h"
#include "support/snapshots.h"

#include <gtest/gtest.h>

#include <set>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::Cell;
using cuboid_mapping::Occupancy;
using cuboid_mapping::test::Random;

/// A floor at z = 0, a table at 0.7 m and a wall, with a little noise.
std::vector<Eigen::Vector3d> makeScene(Random& random) {
  std::vector<Eigen::Vector3d> points;
  const auto noise = [&] { return random.real(-0.01, 0.01); };
  for (int i = 0; i < 2000; ++i) {
    points.emplace_back(random.real(0.5, 5), random.real(-3, 3), noise());
  }
  for (int i = 0; i < 3000; ++i) {
    points.emplace_back(random.real(2, 4), random.real(-1, 1), 0.7 + noise());
  }
  for (int i = 0; i < 500; ++i) {
    points.emplace_back(5.05 + noise(), random.real(-3, 3), random.real(0.2, 2));
  }
  return points;
}

TEST(GroundFilter, getsItsParameters) {
  const auto read = readInto<GroundFilterConfig>({{"ground_filter/distance", 0.1},
                                                  {"ground_filter/angle", 0.2},
                                                  {"ground_filter/plane_distance", 0.3}});
  EXPECT_EQ(read.distance_m, 0.1);
  EXPECT_EQ(read.angle_rad, 0.2);
  EXPECT_EQ(read.plane_distance_m, 0.3);
}

TEST(GroundFilter, findsTheFloorAndNotTheTable) {
  Random random(81);
  // The sensor is 1.2 m above the ground and looks slightly down.
  Eigen::Isometry3d T_base_cloud(Eigen::Translation3d(0.1, 0, 1.2));
  T_base_cloud.rotate(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY()));
  std::vector<Eigen::Vector3f> points;
  for (const Eigen::Vector3d& point : makeScene(random)) {
    points.push_back((T_base_cloud.inverse() * point).cast<float>());
  }
  const GroundSplit split = splitGround(points, T_base_cloud, {});
  EXPECT_TRUE(split.is_plane_found);
  EXPECT_GE(split.ground.size(), 1990U);
  EXPECT_EQ(split.ground.size() + split.others.size(), points.size());
  for (const Eigen::Vector3f& point : split.ground) {
    EXPECT_LT(std::abs((T_base_cloud * point.cast<double>()).z()), 0.05);
  }
  const GroundSplit again = splitGround(points, T_base_cloud, {});
  EXPECT_EQ(again.ground, split.ground) << "the same random numbers every time";
}

TEST(GroundFilter, takesWhatIsLowWhereThereIsNoPlane) {
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 100; ++i) {
    points.emplace_back(static_cast<float>(i), 0.0F, i < 30 ? 0.05F : 3.0F + static_cast<float>(i));
  }
  GroundFilterConfig config;
  config.distance_m = 0.001;
  config.plane_distance_m = 0.07;
  config.angle_rad = 0.001;
  std::vector<Eigen::Vector3f> steep(points);
  for (auto& point : steep) point.z() += point.x() * (point.z() > 1.0F ? 5.0F : 0.0F);
  const GroundSplit split = splitGround(steep, Eigen::Isometry3d::Identity(), config);
  EXPECT_EQ(split.ground.size(), 30U);
  points.resize(49);
  EXPECT_TRUE(splitGround(points, Eigen::Isometry3d::Identity(), {}).ground.empty());
}

TEST(GroundFilter, freesTheSpaceBeforeTheGroundAndHitsNothingThere) {
  Random random(82);
  NodeParameters parameters;
  parameters.map.resolution_m = 0.1;
  parameters.source.filter_ground = true;
  const std::vector<Eigen::Vector3d> scene = makeScene(random);
  std::vector<Eigen::Vector3d> points_cloud;
  const Eigen::Vector3d origin(0.05, 0.05, 1.25);
  for (const Eigen::Vector3d& point : scene) points_cloud.push_back(point - origin);
  CloudSpec spec;
  spec.width = static_cast<std::uint32_t>(points_cloud.size());
  CloudPoses poses;
  poses.T_map_cloud = Eigen::Translation3d(origin);
  poses.T_map_sensor = poses.T_map_cloud;
  poses.T_map_steps = {Eigen::Isometry3d::Identity()};
  SensorInput input(parameters, parameters.source);
  const Observed observed = input.compute(makeSensorMessage(spec, points_cloud), poses);
  const auto* update = observed.update;
  ASSERT_NE(update, nullptr);
  cuboid_mapping::CuboidMap map(makeMapConfig(parameters));
  map.apply(*update);
  EXPECT_EQ(observed.figures.num_points, scene.size());
  std::size_t num_table = 0;
  cuboid_mapping::visitAll(map, cuboid_mapping::CuboidFilter::kOccupied, [&](const auto& cuboid) {
    EXPECT_GT(cuboid.box.max.z, 1) << "nothing of the floor is occupied";
    num_table += cuboid.box.max.z > 5 ? 1 : 0;
    return cuboid_mapping::Visit::kContinue;
  });
  EXPECT_GT(num_table, 10U);
  EXPECT_EQ(map.voxels().at({10, 0, 6}), Occupancy::kFree) << "before the floor";
}

/// Result of an input for one cloud.
struct Outcome {
  std::set<Cell> hits;
  CloudFigures figures;
};

Outcome runInput(const NodeParameters& parameters, const CloudPoses& poses,
                 const std::vector<Eigen::Vector3d>& points_cloud) {
  CloudSpec spec;
  spec.width = static_cast<std::uint32_t>(points_cloud.size());
  SensorInput input(parameters, parameters.source);
  Outcome outcome;
  const Observed observed = input.compute(makeSensorMessage(spec, points_cloud), poses);
  const auto* update = observed.update;
  EXPECT_NE(update, nullptr);
  outcome.figures = observed.figures;
  if (update == nullptr) return outcome;
  cuboid_mapping::CuboidMap map(makeMapConfig(parameters));
  map.apply(*update);
  const auto voxels = cuboid_mapping::test::voxelsOf(map);
  for (const auto& [cell, log_odds] : voxels) {
    if (log_odds >= 0.0F) outcome.hits.insert(cell);
  }
  return outcome;
}

TEST(SensorInput, looksForTheGroundInsideTheLimitsGivenInTheFrameOfTheBase) {
  NodeParameters parameters;
  parameters.map.resolution_m = 0.1;
  parameters.source.filter_ground = true;
  parameters.source.crop.max_m.x() = 2.0;
  CloudPoses poses;
  const Eigen::Isometry3d T_map_base =
      Eigen::Translation3d(5, 0, 0) * Eigen::AngleAxisd(0.5 * EIGEN_PI, Eigen::Vector3d::UnitZ());
  poses.T_map_steps = {T_map_base};
  poses.T_map_cloud = T_map_base * Eigen::Translation3d(0, 0, 1.05);
  poses.T_map_sensor = poses.T_map_cloud;
  // Points in the frame of the base: a floor, a wall on it, and beyond 2 m a wide road, lower by a
  // kerb, which would be taken for the ground instead of the floor.
  std::vector<Eigen::Vector3d> points_base;
  Random random(83);
  for (int i = 0; i < 300; ++i) {
    points_base.emplace_back(random.real(0.5, 1.9), random.real(-1, 1), 0.0);
  }
  for (int i = 0; i < 3000; ++i) {
    points_base.emplace_back(random.real(2.1, 9), random.real(-4, 4), -0.06);
  }
  std::set<Cell> wall;
  for (int i = 0; i < 8; ++i) {
    points_base.emplace_back(1.55, 0.35 - 0.1 * i, 0.55);
    wall.insert({46 + i, 15, 5});  // base y is map -x
  }
  for (Eigen::Vector3d& point : points_base) point.z() -= 1.05;
  const Outcome cropped = runInput(parameters, poses, points_base);
  EXPECT_EQ(cropped.hits, wall);
  EXPECT_EQ(cropped.figures.num_filtered, 3000U);

  parameters.source.crop = SourceParameters().crop;
  EXPECT_GT(runInput(parameters, poses, points_base).hits.size(), wall.size() + 100)
      << "the road is the ground now";
  parameters.source.filter_ground = false;
  parameters.source.crop.max_m.x() = 5.0;
  poses.T_map_steps.clear();
  for (const Cell& cell : runInput(parameters, poses, points_base).hits) {
    EXPECT_LE(cell.x, 50) << "without the filter the limits are in the frame of the map";
  }
}

TEST(GroundFilter, KeepsTheFootOfAWallOnTheGround) {
  NodeParameters parameters;
  parameters.map.resolution_m = 0.1;
  parameters.source.filter_ground = true;
  CloudPoses poses;
  poses.T_map_cloud = Eigen::Translation3d(0.05, 0.05, 1.05);
  poses.T_map_sensor = poses.T_map_cloud;
  poses.T_map_steps = {Eigen::Isometry3d::Identity()};
  SensorInput input(parameters, parameters.source);
  cuboid_mapping::CuboidMap map(makeMapConfig(parameters));
  const auto insert = [&](double z) {
    std::vector<Eigen::Vector3d> points_cloud;
    for (int i = 0; i < 200; ++i) {
      points_cloud.emplace_back(1.0 + 0.005 * i, 0.01 * (i % 20), -1.04);
    }
    for (int i = 0; i < 10; ++i) points_cloud.emplace_back(2.0, 0.02 * i, z - 1.05);
    CloudSpec spec;
    spec.width = static_cast<std::uint32_t>(points_cloud.size());
    const Observed observed = input.compute(makeSensorMessage(spec, points_cloud), poses);
    const auto* update = observed.update;
    ASSERT_NE(update, nullptr);
    (void)map.apply(*update);
  };
  insert(0.09);  // The foot of a wall, higher than the ground: an obstacle.
  ASSERT_EQ(map.voxels().at({20, 0, 0}), Occupancy::kOccupied);
  for (int i = 0; i < 30; ++i) insert(0.01);  // Beams that end at its foot, at ground level.
  EXPECT_EQ(map.voxels().at({20, 0, 0}), Occupancy::kOccupied);
}

TEST(SensorInput, needsTheTransformOfTheBase) {
  NodeParameters parameters;
  parameters.source.filter_ground = true;
  EXPECT_EQ(PoseFrames(parameters, parameters.source).needed(),
            std::vector<std::string>{"base_footprint"});
  TfBuffer tf;
  tf.setTransform(test::makeTransform("map", "lidar", Eigen::Isometry3d::Identity()), "test", true);
  std_msgs::Header header;
  header.frame_id = "lidar";
  header.stamp = ros::Time(5.0);
  const PoseFrames frames(parameters, parameters.source);
  const PoseSearch search = findPoses(tf, frames, header, {});
  EXPECT_FALSE(search.poses) << "never with a wrong pose";
  EXPECT_NE(search.why.find("base_footprint"), std::string::npos) << search.why;
  EXPECT_NE(search.why.find("(base_frame_id)"), std::string::npos) << search.why;
  tf.setTransform(test::makeTransform("map", "base_footprint", Eigen::Isometry3d::Identity()),
                  "test", true);
  EXPECT_TRUE(findPoses(tf, frames, header, {}).poses);
}

}  // namespace
}  // namespace cuboid_mapping_ros
