// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/interop/fcl_obstacles.h"

#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/query/nearest_query.h"
#include "support/modelled_map.h"

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/sphere.h>
#include <gtest/gtest.h>

#include <limits>

namespace cuboid_mapping {
namespace {

using test::Random;

fcl::CollisionObjectd at(const Eigen::Vector3d& point,
                         const std::shared_ptr<fcl::CollisionGeometryd>& shape) {
  fcl::CollisionObjectd object(shape, Eigen::Matrix3d::Identity(), point);
  object.computeAABB();
  return object;
}

TEST(FclObstacles, areNoneInAnEmptyMap) {
  FclObstacles obstacles(CuboidMap(), kAllCells);
  EXPECT_EQ(obstacles.size(), 0U);
  auto robot = at({0, 0, 0}, std::make_shared<fcl::Sphered>(1.0));
  EXPECT_FALSE(obstacles.collides(robot));
  EXPECT_EQ(obstacles.computeDistance_m(robot), std::numeric_limits<double>::infinity());
}

TEST(FclObstacles, meetBoxesAndSpheresAsTheQueriesOfTheMapSay) {
  Random random(141);
  MapConfig config;
  config.resolution_m = 0.1;
  const test::ModelledMap model = test::randomMap(random, config);
  FclObstacles obstacles(model.map, kAllCells);
  EXPECT_EQ(obstacles.size(), countCuboids(model.map).occupied);
  std::size_t num_met = 0;
  constexpr std::size_t kCases = 500;
  for (std::size_t i = 0; i < kCases; ++i) {
    const Eigen::Vector3d point = test::randomPoint(random, 2.5);
    const Eigen::Vector3d size_m(random.real(0.05, 0.6), random.real(0.05, 0.6), 0.3);
    auto box = at(point, std::make_shared<fcl::Boxd>(size_m));
    const bool is_met = queryBox(model.map, MetricBox{point - 0.5 * size_m, point + 0.5 * size_m},
                                 Budget::unlimited())
                            ->occupancy() == Occupancy::kOccupied;
    ASSERT_EQ(obstacles.collides(box), is_met) << test::seedNote(i);
    num_met += is_met ? 1 : 0;

    const double radius_m = random.real(0.01, 0.3);
    auto ball = at(point, std::make_shared<fcl::Sphered>(radius_m));
    const auto nearest =
        findNearest(model.map, point, 1, CuboidFilter::kOccupied, Budget::unlimited()).value;
    const double distance_m = std::max(0.0, nearest.at(0).distance_m - radius_m);
    ASSERT_NEAR(obstacles.computeDistance_m(ball), distance_m, 2e-3) << test::seedNote(i);
  }
  EXPECT_GT(num_met, kCases / 20);
  EXPECT_LT(num_met, kCases * 19 / 20);
}

TEST(FclObstacles, areThoseOfTheRegion) {
  CuboidMap map;
  map.replace(kAllCells, {{{{0, 0, 0}, {2, 2, 2}}, 1.0F},
                          {{{4, 0, 0}, {6, 2, 2}}, 1.0F},
                          {{{8, 0, 0}, {9, 2, 2}}, -1.0F}});
  EXPECT_EQ(FclObstacles(map, {{1, 0, 0}, {3, 1, 1}}).size(), 1U);
  EXPECT_EQ(FclObstacles(map, {{0, 0, 0}, {20, 2, 2}}).size(), 2U) << "without the free one";
}

}  // namespace
}  // namespace cuboid_mapping
