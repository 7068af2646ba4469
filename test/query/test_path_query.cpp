// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/path_query.h"

#include "support/dense_obstacles.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace cuboid_mapping {
namespace {

using test::DenseObstacles;
using test::Random;
using Path = std::vector<Eigen::Vector3d>;

constexpr CellBox kPathArea{{-16, -16, -16}, {16, 16, 16}};

MapConfig configOf(double resolution_m) {
  MapConfig config;
  config.resolution_m = resolution_m;
  return config;
}

/// A tunnel, free from x = 0 to 10, y and z from 0 to 2, at 1 m; then an obstacle one voxel thick.
CuboidMap tunnel() {
  CuboidMap map(configOf(1.0));
  map.replace(kAllCells, {{{{0, 0, 0}, {10, 2, 2}}, -1.0F}, {{{10, 0, 0}, {11, 2, 2}}, 1.0F}});
  return map;
}

const Eigen::Vector3d kCube = Eigen::Vector3d::Constant(2.0);

TEST(PathQuery, tellsWhereABoxFirstMeetsAnObstacle) {
  const Path path{{1, 1, 1}, {4, 1, 1}, {12, 1, 1}};
  const auto result =
      checkPath(tunnel(), path, kCube, UnknownPolicy::kObstacle, Budget::unlimited());
  ASSERT_TRUE(result.isFound());
  EXPECT_DOUBLE_EQ(lengthOf(path), 11.0);
  EXPECT_EQ(result->segment, 1U);
  EXPECT_NEAR(result->distance_m, 8.0, 1e-5);
  EXPECT_NEAR((result->point_map - Eigen::Vector3d(9, 1, 1)).norm(), 0.0, 1e-5);
  EXPECT_EQ(result->voxel.x, 10);
}

TEST(PathQuery, doesNotCountFacesThatTouch) {
  const CuboidMap map = tunnel();
  EXPECT_FALSE(checkPath(map, Path{{1, 1, 1}, {9, 1, 1}}, kCube, UnknownPolicy::kObstacle,
                         Budget::unlimited())
                   .isFound());
  EXPECT_TRUE(checkPath(map, Path{{1, 1, 1}, {9.01, 1, 1}}, kCube, UnknownPolicy::kObstacle,
                        Budget::unlimited())
                  .isFound());
  const Eigen::Vector3d wider(2.0, 2.01, 2.0);
  EXPECT_TRUE(checkPath(map, Path{{1, 1, 1}, {2, 1, 1}}, wider, UnknownPolicy::kObstacle,
                        Budget::unlimited())
                  .isFound());
}

TEST(PathQuery, doesNotCountFacesThatTouchButForRounding) {
  const Eigen::Vector3d cube = Eigen::Vector3d::Constant(0.3);
  for (std::int32_t z = 0; z < 100; ++z) {
    // The top of the box, (z + 1.5) * 0.1 + 0.15, is sometimes slightly above the top of the voxels.
    CuboidMap map(configOf(0.1));
    map.replace(kAllCells, {{{{0, 0, z}, {20, 3, z + 3}}, -1.0F}});
    const double z_m = (z + 1.5) * 0.1;
    const Path path{{0.5, 0.15, z_m}, {1.5, 0.15, z_m}};
    EXPECT_FALSE(
        checkPath(map, path, cube, UnknownPolicy::kObstacle, Budget::unlimited()).isFound())
        << z;
  }
}

TEST(PathQuery, looksAtOneWaypointAsABoxThatStands) {
  const auto blocked =
      checkPath(tunnel(), Path{{9.5, 1, 1}}, kCube, UnknownPolicy::kObstacle, Budget::unlimited());
  ASSERT_TRUE(blocked.isFound());
  EXPECT_EQ(blocked->segment, 0U);
  EXPECT_EQ(blocked->distance_m, 0.0);
  EXPECT_FALSE(
      checkPath(tunnel(), Path{{5, 1, 1}}, kCube, UnknownPolicy::kObstacle, Budget::unlimited())
          .isFound());
}

TEST(PathQuery, meetsUnknownSpaceByPolicy) {
  const CuboidMap map = tunnel();
  const Path out{{5, 1, 1}, {5, 1, 100}};
  EXPECT_FALSE(checkPath(map, out, kCube, UnknownPolicy::kFree, Budget::unlimited()).isFound());
  const auto stopped = checkPath(map, out, kCube, UnknownPolicy::kObstacle, Budget::unlimited());
  ASSERT_TRUE(stopped.isFound());
  EXPECT_NEAR(stopped->distance_m, 0.0, 1e-5);
  EXPECT_EQ(stopped->voxel.z, 2);
}

TEST(PathQuery, isInvalidForWhatIsNoPathOrNoBox) {
  const CuboidMap map = tunnel();
  const auto is_refused = [&](const Path& path, const Eigen::Vector3d& size_m) {
    EXPECT_EQ(isPathFree(map, path, size_m, UnknownPolicy::kFree, Budget::unlimited()),
              checkPath(map, path, size_m, UnknownPolicy::kFree, Budget::unlimited()).isNotFound());
    return checkPath(map, path, size_m, UnknownPolicy::kFree, Budget::unlimited()).status ==
           AnswerStatus::kInvalid;
  };
  EXPECT_TRUE(is_refused({}, kCube));
  EXPECT_TRUE(is_refused({{1, 1, 1}}, {1, 0, 1}));
  EXPECT_TRUE(is_refused({{1, 1, 1}}, {1, -1, 1}));
  EXPECT_TRUE(is_refused({{1, 1, 1}}, {1, 1, std::nan("")}));
  EXPECT_TRUE(is_refused({{1, 1, std::nan("")}}, kCube));
  EXPECT_TRUE(is_refused({{1, 1, 1}, {1e12, 1, 1}}, kCube));
  EXPECT_TRUE(is_refused({{std::numeric_limits<double>::infinity(), 1, 1}}, kCube));
}

Path randomPath(Random& random) {
  Path path;
  const int num_waypoints = random.integer(1, 4);
  for (int i = 0; i < num_waypoints; ++i) {
    Eigen::Vector3d point = test::randomPoint(random, 17.0);
    if (i > 0 && random.chance(0.4)) {  // The step is along an axis.
      const int axis = random.integer(0, 2);
      const double coordinate = point[axis];
      point = path.back();
      point[axis] = coordinate;
    }
    if (random.chance(0.2)) point = point.array().round();
    path.push_back(point);
  }
  return path;
}

/// Voxels that a box at a point overlaps, enlarged or shrunk on all sides by a margin.
CellBox voxelsAt(const Grid& grid, const Eigen::Vector3d& center, const Eigen::Vector3d& size_m,
                 double margin) {
  return *grid.toCellBox(
      boxAround(center, (size_m.array() + 2.0 * margin).cwiseMax(1e-3).matrix()));
}

Eigen::Vector3d pointAt(const Path& path, double distance_m) {
  for (std::size_t i = 1; i < path.size(); ++i) {
    const double length_m = (path[i] - path[i - 1]).norm();
    if (distance_m <= length_m && length_m > 0.0) {
      return path[i - 1] + distance_m / length_m * (path[i] - path[i - 1]);
    }
    distance_m -= length_m;
  }
  return path.back();
}

TEST(PathQuery, agreesWithALookAtEveryVoxel) {
  Random random(71);
  constexpr std::size_t kMaps = 50;
  std::size_t num_cases = 0;
  std::size_t num_blocked = 0;
  std::size_t num_blocked_on_the_way = 0;
  for (std::size_t m = 0; m < kMaps; ++m) {
    const UnknownPolicy policy = m % 2 == 0 ? UnknownPolicy::kObstacle : UnknownPolicy::kFree;
    const test::ModelledMap model = test::randomRooms(random, configOf(1.0), kPathArea);
    DenseObstacles obstacles(model.voxels, kPathArea, policy);
    for (int i = 0; i < 200; ++i, ++num_cases) {
      const Path path = randomPath(random);
      const Eigen::Vector3d size_m(random.real(0.1, 3.0), random.real(0.1, 3.0),
                                   random.chance(0.5) ? 1.0 : 3.0);
      const auto result = checkPath(model.map, path, size_m, policy, Budget::unlimited());
      ASSERT_EQ(isPathFree(model.map, path, size_m, policy, Budget::unlimited()),
                result.isNotFound())
          << test::seedNote(num_cases);
      const double free_m = result.isFound() ? result->distance_m : lengthOf(path);
      const Grid& grid = model.map.grid();
      // If it is blocked at the start, no part of it is free.
      const int num_samples = result.isFound() && free_m == 0.0 ? -1 : 40;
      for (int sample = 0; sample <= num_samples; ++sample) {
        const Eigen::Vector3d point = pointAt(path, free_m * sample / 40.0);
        ASSERT_FALSE(obstacles.isAny(voxelsAt(grid, point, size_m, -1e-4)))
            << point.transpose() << " " << test::seedNote(num_cases);
      }
      if (!result.isFound()) continue;
      ++num_blocked;
      num_blocked_on_the_way += free_m > 0.0 ? 1 : 0;
      const PathContact& contact = *result;
      ASSERT_TRUE(obstacles.isAny(CellBox::ofCell(contact.voxel))) << test::seedNote(num_cases);
      ASSERT_TRUE(voxelsAt(grid, contact.point_map, size_m, 1e-4).contains(contact.voxel))
          << test::seedNote(num_cases);
      ASSERT_NEAR((pointAt(path, free_m) - contact.point_map).norm(), 0.0, 1e-6);
    }
  }
  EXPECT_EQ(num_cases, 10000U);
  EXPECT_GT(num_blocked, 4000U);
  EXPECT_LT(num_blocked, 9800U);
  EXPECT_GT(num_blocked_on_the_way, 2000U);
}

TEST(PathQuery, isExactForMotionAlongAnAxis) {
  Random random(72);
  const test::ModelledMap model = test::randomRooms(random, configOf(1.0), kPathArea);
  DenseObstacles obstacles(model.voxels, kPathArea, UnknownPolicy::kObstacle);
  std::size_t num_free = 0;
  constexpr std::size_t kCases = 10000;
  for (std::size_t i = 0; i < kCases; ++i) {
    const Eigen::Vector3d from = test::randomPoint(random, 14.0);
    Eigen::Vector3d to = from;
    to[random.integer(0, 2)] += random.real(-4.0, 4.0);
    const Eigen::Vector3d size_m = Eigen::Vector3d::Constant(random.real(0.2, 2.0));
    const MetricBox swept{from.cwiseMin(to) - 0.5 * size_m, from.cwiseMax(to) + 0.5 * size_m};
    const bool is_blocked = obstacles.isAny(*model.map.grid().toCellBox(swept));
    const auto result =
        checkPath(model.map, Path{from, to}, size_m, UnknownPolicy::kObstacle, Budget::unlimited());
    ASSERT_EQ(result.isFound(), is_blocked) << test::seedNote(i);
    num_free += is_blocked ? 0 : 1;
  }
  EXPECT_GT(num_free, kCases / 20);
}

}  // namespace
}  // namespace cuboid_mapping
