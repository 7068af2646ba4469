// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/lidar.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

namespace cuboid_mapping {
namespace {

using Eigen::Vector3d;

LidarConfig makeConfig(int rings, int columns, double noise_m = 0.0) {
  LidarConfig config;
  config.rings = rings;
  config.columns = columns;
  config.range_noise_m = noise_m;
  return config;
}

Eigen::Isometry3d poseAt(const World& world, double time_s) {
  return world.computeRobotPose(time_s) * Eigen::Translation3d(0.1, 0.0, 1.0);
}

bool isReturn(const LidarPoint& point) { return std::isfinite(point.x); }

Vector3d toVector(const LidarPoint& point) { return {point.x, point.y, point.z}; }

bool haveSameBytes(const LidarCloud& a, const LidarCloud& b) {
  return a.points.size() == b.points.size() &&
         std::memcmp(a.points.data(), b.points.data(), a.points.size() * sizeof(LidarPoint)) == 0;
}

/// The beam of a point of a cloud, by the documented layout.
Beam makeBeam(const LidarConfig& config, int ring, int column,
              const Eigen::Isometry3d& T_map_lidar) {
  const double share = config.rings == 1 ? 0.0 : static_cast<double>(ring) / (config.rings - 1);
  const double elevation =
      config.max_elevation_rad - share * (config.max_elevation_rad - config.min_elevation_rad);
  const Vector3d direction =
      Eigen::AngleAxisd(2 * M_PI * column / config.columns, Vector3d::UnitZ()) *
      Vector3d(std::cos(elevation), 0.0, std::sin(elevation));
  return {T_map_lidar.translation(), T_map_lidar.linear() * direction};
}

TEST(Lidar, sendsTheHighestRingFirstAndGoesAnticlockwiseFromX) {
  LidarConfig config = makeConfig(3, 4);
  config.min_elevation_rad = -M_PI / 4;
  config.max_elevation_rad = M_PI / 4;
  // Walls at x = 2, y = 3, x = -4, y = -5, high and deep.
  const std::vector<Solid> walls = {{SolidKind::kWall, MetricBox{{2, -1, -9}, {2.1, 1, 9}}},
                                    {SolidKind::kWall, MetricBox{{-1, 3, -9}, {1, 3.1, 9}}},
                                    {SolidKind::kWall, MetricBox{{-4.1, -1, -9}, {-4, 1, 9}}},
                                    {SolidKind::kDoor, MetricBox{{-1, -5.1, -9}, {1, -5, 9}}}};
  const LidarCloud cloud = Lidar(config).computeCloud(walls, Eigen::Isometry3d::Identity(), 0);
  ASSERT_EQ(cloud.rings, 3);
  ASSERT_EQ(cloud.columns, 4);
  ASSERT_EQ(cloud.points.size(), 12U);
  const Vector3d hits[] = {{2, 0, 2}, {0, 3, 3}, {-4, 0, 4}, {0, -5, 5}};
  for (int ring = 0; ring < 3; ++ring) {
    for (int column = 0; column < 4; ++column) {
      Vector3d expected = hits[column];
      expected.z() *= 1 - ring;
      const LidarPoint& point = cloud.points[ring * 4 + column];
      EXPECT_LT((toVector(point) - expected).norm(), 1e-6) << ring << ' ' << column;
      EXPECT_EQ(point.intensity,
                computeReflectivity(column == 3 ? SolidKind::kDoor : SolidKind::kWall));
    }
  }
}

TEST(Lidar, measuresInItsOwnFrame) {
  const Eigen::Isometry3d T_map_lidar =
      Eigen::Translation3d(10, 20, 1) * Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitZ());
  const std::vector<Solid> wall = {{SolidKind::kWall, MetricBox{{5, 24, 0}, {15, 25, 2}}}};
  LidarConfig config = makeConfig(1, 4);
  config.min_elevation_rad = config.max_elevation_rad = 0.0;
  const LidarCloud cloud = Lidar(config).computeCloud(wall, T_map_lidar, 0);
  EXPECT_LT((toVector(cloud.points[0]) - Vector3d(4, 0, 0)).norm(), 1e-6);
  for (int column = 1; column < 4; ++column) EXPECT_FALSE(isReturn(cloud.points[column]));
}

TEST(Lidar, seesTheNearestSolidOnEveryBeam) {
  const LidarConfig config = makeConfig(16, 90);
  const Lidar lidar(config);
  int returns = 0;
  int no_returns = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const World world(seed);
    for (double time = 0.0; time < world.lapDuration(); time += 3.7) {
      const std::vector<Solid> solids = world.computeSolids(time);
      const Eigen::Isometry3d pose = poseAt(world, time);
      const LidarCloud cloud = lidar.computeCloud(solids, pose, 0);
      for (int i = 0; i < config.rings * config.columns; ++i) {
        const Beam beam = makeBeam(config, i / config.columns, i % config.columns, pose);
        double nearest = std::numeric_limits<double>::infinity();
        for (const Solid& solid : solids) {
          nearest = std::min(nearest, computeRange(solid.shape, beam));
        }
        if (isReturn(cloud.points[i])) {
          ASSERT_NEAR(toVector(cloud.points[i]).norm(), nearest, 1e-4) << i;
          ++returns;
        } else {
          ASSERT_GT(nearest, config.max_range_m - 1e-6);
          ++no_returns;
        }
      }
    }
  }
  EXPECT_GT(returns, 20000);
  EXPECT_GT(no_returns, 5000);
}

TEST(Lidar, returnsLieOnSurfacesWithinTheNoise) {
  const LidarConfig config = makeConfig(16, 180, 0.02);
  const Lidar lidar(config);
  const World world(2);
  int returns = 0;
  for (double time = 0.0; time < world.lapDuration(); time += 4.1) {
    const std::vector<Solid> solids = world.computeSolids(time);
    const Eigen::Isometry3d pose = poseAt(world, time);
    for (const LidarPoint& point : lidar.computeCloud(solids, pose, 7).points) {
      if (!isReturn(point)) continue;
      double distance = std::numeric_limits<double>::infinity();
      for (const Solid& solid : solids) {
        const double signed_distance = computeSignedDistance(solid.shape, pose * toVector(point));
        distance = std::min(distance, std::abs(signed_distance));
      }
      ASSERT_LE(distance, 3 * config.range_noise_m + 1e-4);
      ++returns;
    }
  }
  EXPECT_GT(returns, 20000);
}

TEST(Lidar, hasTheConfiguredNoise) {
  const World world(1);
  const std::vector<Solid> solids = world.computeSolids(0.0);
  const Eigen::Isometry3d pose = poseAt(world, 0.0);
  const LidarCloud exact = Lidar(makeConfig(32, 450)).computeCloud(solids, pose, 0);
  const LidarCloud noisy = Lidar(makeConfig(32, 450, 0.05)).computeCloud(solids, pose, 0);
  double sum = 0.0;
  double sum_of_squares = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < exact.points.size(); ++i) {
    ASSERT_EQ(isReturn(exact.points[i]), isReturn(noisy.points[i]));
    if (!isReturn(exact.points[i])) continue;
    const double error = toVector(noisy.points[i]).norm() - toVector(exact.points[i]).norm();
    sum += error;
    sum_of_squares += error * error;
    ++count;
  }
  ASSERT_GT(count, 10000);
  EXPECT_NEAR(sum / count, 0.0, 0.002);
  EXPECT_NEAR(std::sqrt(sum_of_squares / count), 0.05, 0.003);
}

TEST(Lidar, isTheSameForTheSameSeedAndNumber) {
  const World world(1);
  const std::vector<Solid> solids = world.computeSolids(5.0);
  const Eigen::Isometry3d pose = poseAt(world, 5.0);
  LidarConfig config = makeConfig(8, 90, 0.01);
  const Lidar lidar(config);
  const LidarCloud cloud = lidar.computeCloud(solids, pose, 3);
  EXPECT_FALSE(haveSameBytes(cloud, lidar.computeCloud(solids, pose, 4)));
  EXPECT_TRUE(haveSameBytes(cloud, lidar.computeCloud(solids, pose, 3)));
  EXPECT_TRUE(haveSameBytes(cloud, Lidar(config).computeCloud(solids, pose, 3)));
  config.seed = 2;
  EXPECT_FALSE(haveSameBytes(cloud, Lidar(config).computeCloud(solids, pose, 3)));
}

TEST(Lidar, getsNoReturnFromBeyondItsMaximumRange) {
  const World world(1);
  const std::vector<Solid> solids = world.computeSolids(0.0);
  const Eigen::Isometry3d pose = poseAt(world, 0.0);
  LidarConfig config = makeConfig(16, 90);
  const LidarCloud far = Lidar(config).computeCloud(solids, pose, 0);
  config.max_range_m = 3.0;
  const LidarCloud near = Lidar(config).computeCloud(solids, pose, 0);
  int cut = 0;
  for (std::size_t i = 0; i < far.points.size(); ++i) {
    const bool is_near = isReturn(far.points[i]) && toVector(far.points[i]).norm() <= 3.0;
    ASSERT_EQ(isReturn(near.points[i]), is_near) << i;
    if (isReturn(far.points[i]) && !is_near) ++cut;
  }
  EXPECT_GT(cut, 50);
}

TEST(Lidar, seesTheSkyInTheYardOnly) {
  const World world(1);
  const Lidar lidar(makeConfig(16, 90));
  const auto shareOfReturns = [&](double time) {
    const LidarCloud cloud = lidar.computeCloud(world.computeSolids(time), poseAt(world, time), 0);
    return static_cast<double>(std::count_if(cloud.points.begin(), cloud.points.end(), isReturn)) /
           static_cast<double>(cloud.points.size());
  };
  EXPECT_GT(shareOfReturns(0.0), 0.95);   // in the corridor
  EXPECT_LT(shareOfReturns(20.0), 0.75);  // in the yard
}

TEST(CheckLidarConfig, namesEveryKeyThatIsWrong) {
  EXPECT_TRUE(checkLidarConfig(LidarConfig{}).empty());
  LidarConfig config;
  config.rings = 0;
  config.columns = -3;
  config.max_range_m = std::numeric_limits<double>::quiet_NaN();
  config.range_noise_m = -0.1;
  config.min_elevation_rad = 1.0;
  const std::vector<std::string> errors = checkLidarConfig(config);
  ASSERT_EQ(errors.size(), 5U);
  EXPECT_EQ(errors[0], "rings = 0: must be from 1 to 1024");
  EXPECT_EQ(errors[1].rfind("columns = -3", 0), 0U);
  EXPECT_EQ(errors[2].rfind("max_elevation", 0), 0U);
  EXPECT_EQ(errors[3].rfind("max_range = nan", 0), 0U);
  EXPECT_EQ(errors[4].rfind("noise = -0.1", 0), 0U);
}

}  // namespace
}  // namespace cuboid_mapping
