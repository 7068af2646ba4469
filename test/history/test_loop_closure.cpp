// SPDX-License-Identifier: BSD-3-Clause
// A drive through the simulated building with drifting odometry that closes a loop: corrected poses as from a pose graph.
#include "cuboid_mapping/history/kept_clouds.h"
#include "cuboid_mapping/history/map_history.h"
#include "cuboid_mapping/map/mapper.h"
#include "simulation/lidar.h"
#include "support/random.h"
#include "support/snapshots.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <vector>

namespace cuboid_mapping {
namespace {

constexpr double kResolution_m = 0.2;
constexpr int kCloudsALap = 80;
constexpr int kNumClouds = kCloudsALap + 20;  ///< The last clouds close the loop.

Eigen::Isometry3d makeStep(const Eigen::Vector3d& shift_m, double yaw_rad) {
  return Eigen::Translation3d(shift_m) * Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ());
}

/// Clouds of the drive, with poses of odometry and poses of a pose graph.
struct LoopDrive {
  std::vector<KeptCloud> clouds;  ///< Clouds with the poses of odometry.
  std::vector<Eigen::Isometry3d> truth;
  std::vector<StampedPose> optimized;
};

double yawOf(const Eigen::Isometry3d& pose) {
  return std::atan2(pose.linear()(1, 0), pose.linear()(0, 0));
}

/// Poses as from a pose graph of a chain with one loop: each step takes its share of the error of the last pose.
std::vector<StampedPose> closeLoop(const LoopDrive& drive) {
  const auto& clouds = drive.clouds;
  const Eigen::Isometry3d& last = clouds.back().T_map_body;
  const double yaw_rad = yawOf(last.inverse() * drive.truth.back()) / (kNumClouds - 1);
  std::vector<Eigen::Isometry3d> poses{clouds.front().T_map_body};
  for (std::size_t i = 1; i < clouds.size(); ++i) {
    const Eigen::Isometry3d step = clouds[i - 1].T_map_body.inverse() * clouds[i].T_map_body;
    poses.push_back(poses.back() * step * makeStep({0.0, 0.0, 0.0}, yaw_rad));
  }
  const Eigen::Vector3d error_m = drive.truth.back().translation() - poses.back().translation();
  std::vector<StampedPose> optimized;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (i % 3 != 0 && i + 1 != poses.size()) continue;  // Only key frames have a pose.
    poses[i].pretranslate(static_cast<double>(i) / (kNumClouds - 1) * error_m);
    optimized.push_back({clouds[i].stamp_ns, poses[i]});
  }
  return optimized;
}

LoopDrive drive() {
  LoopDrive drive;
  test::Random random(41);
  const World world(1);
  LidarConfig config;
  config.rings = 16;
  config.columns = 180;
  const Lidar lidar(config);
  Eigen::Isometry3d odometry = Eigen::Isometry3d::Identity();
  for (int i = 0; i < kNumClouds; ++i) {
    const Eigen::Isometry3d T_map_lidar =
        world.computeRobotPose(i * world.lapDuration() / kCloudsALap) *
        Eigen::Translation3d(0.1, 0.0, 1.0);
    const Eigen::Isometry3d step =
        i == 0 ? T_map_lidar : drive.truth.back().inverse() * T_map_lidar;
    const double slip_yaw = random.real(-0.001, 0.003);
    const Eigen::Isometry3d slip = makeStep(
        {random.real(-0.01, 0.02), random.real(-0.01, 0.01), random.real(-0.002, 0.004)}, slip_yaw);
    odometry = i == 0 ? T_map_lidar : odometry * step * slip;
    drive.truth.push_back(T_map_lidar);
    KeptCloud& cloud = drive.clouds.emplace_back();
    cloud.stamp_ns = 1600000000000000000 + 1000000000LL * i;
    cloud.T_map_body = PoseTrack({{0, odometry}}).at(0);
    Scan& scan = cloud.scans_body.emplace_back();
    const LidarCloud seen =
        lidar.computeCloud(world.fixedSolids(), T_map_lidar, static_cast<std::uint64_t>(i));
    for (const LidarPoint& point : seen.points) {
      if (std::isfinite(point.x)) scan.points.emplace_back(point.x, point.y, point.z);
    }
    roundScan(scan, kResolution_m / kKeptStepsPerVoxel);
  }
  drive.optimized = closeLoop(drive);
  return drive;
}

MapConfig makeConfig(int threads) {
  MapConfig config;
  config.resolution_m = kResolution_m;
  config.threads = threads;
  return config;
}

/// The map of the clouds from scratch. @param pose  Pose of the cloud with a number.
template <typename PoseT>
std::map<Cell, float> mapOf(const LoopDrive& drive, const PoseT& pose) {
  MapperConfig config;
  config.map = makeConfig(1);
  Mapper mapper(config);
  for (std::size_t i = 0; i < drive.clouds.size(); ++i) {
    mapper.integrate(placeScan(pose(i), drive.clouds[i].scans_body.front()));
  }
  return test::voxelsOf(takeSnapshot(mapper.map(), "").bricks);
}

/// Share of the occupied voxels that are occupied in another map, too.
double findShare(const std::map<Cell, float>& map, const std::map<Cell, float>& other) {
  double num_occupied = 0.0;
  double num_shared = 0.0;
  for (const auto& [cell, value] : map) {
    if (value < 0.0F) continue;
    num_occupied += 1.0;
    const auto found = other.find(cell);
    num_shared += found != other.end() && found->second >= 0.0F ? 1.0 : 0.0;
  }
  return num_shared / num_occupied;
}

TEST(LoopClosure, makesTheMapOfTheOptimizedPoses) {
  const LoopDrive loop = drive();
  const auto old_pose = [&](std::size_t i) { return loop.clouds[i].T_map_body; };
  const auto error_m = [&](const Eigen::Isometry3d& pose) {
    return (pose.translation() - loop.truth.back().translation()).norm();
  };
  ASSERT_GT(error_m(old_pose(kNumClouds - 1)), 1.0) << "odometry drifts";
  const PoseTrack track(loop.optimized);
  MapHistory history(makeConfig(2), kResolution_m / kKeptStepsPerVoxel, {});
  for (const KeptCloud& cloud : loop.clouds) history.add(cloud, {});
  MapCorrection correction = history.correct(track);
  const auto corrected = test::voxelsOf(takeSnapshot(correction.map(), "").bricks);
  EXPECT_EQ(corrected,
            mapOf(loop, [&](std::size_t i) { return track.at(loop.clouds[i].stamp_ns); }));
  const auto drifted = mapOf(loop, old_pose);
  EXPECT_FALSE(corrected == drifted);
  const auto truth = mapOf(loop, [&](std::size_t i) { return loop.truth[i]; });
  EXPECT_GT(findShare(corrected, truth), 1.3 * findShare(drifted, truth));
}

}  // namespace
}  // namespace cuboid_mapping
