// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/distance_field.h"

#include "support/random_bricks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace cuboid_mapping {
namespace {

using test::Random;

constexpr CellBox kFieldArea{{-24, -24, -12}, {24, 24, 12}};
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::vector<Cell> findObstacles(const CuboidMap& map, const CellBox& box, UnknownPolicy policy) {
  std::vector<Cell> obstacles;
  test::visitCells(box, [&](const Cell& cell) {
    const Occupancy occupancy = map.voxels().at(cell);
    const bool is_unknown = occupancy == Occupancy::kUnknown && policy == UnknownPolicy::kObstacle;
    if (occupancy == Occupancy::kOccupied || is_unknown) obstacles.push_back(cell);
  });
  return obstacles;
}

/// Distance found by checking every obstacle.
double leastDistance(const std::vector<Cell>& obstacles, const Cell& cell) {
  double least = kInfinity;
  for (const Cell& obstacle : obstacles) {
    least = std::min(least, (toVector(obstacle) - toVector(cell)).squaredNorm());
  }
  return std::sqrt(least);
}

/// @return Number of voxels within the bound.
std::size_t expectExact(const CuboidMap& map, const DistanceField& field, double bound_m,
                        UnknownPolicy policy) {
  const auto reach = static_cast<std::int32_t>(std::ceil(bound_m / map.grid().resolution()));
  const CellBox& region = field.region();
  const std::vector<Cell> obstacles = findObstacles(
      map, {region.min - Cell{reach, reach, reach}, region.max + Cell{reach, reach, reach}},
      policy);
  std::size_t num_near = 0;
  test::visitCells(region, [&](const Cell& cell) {
    const double least_m = leastDistance(obstacles, cell) * map.grid().resolution();
    const Eigen::Vector3d center = map.grid().centerOf(CellBox::ofCell(cell));
    const auto found = field.distanceAt(center);
    ASSERT_TRUE(found);
    if (least_m > bound_m * (1.0 + 1e-9)) {
      EXPECT_EQ(*found, kInfinity) << cell;
      EXPECT_EQ(*field.gradientAt(center), Eigen::Vector3d(Eigen::Vector3d::Zero()));
      EXPECT_FALSE(field.findNearest(cell));
      return;
    }
    ++num_near;
    EXPECT_NEAR(*found, least_m, 1e-9) << cell;
    const auto nearest = field.findNearest(cell);
    ASSERT_TRUE(nearest);
    EXPECT_EQ(findObstacles(map, CellBox::ofCell(*nearest), policy).size(), 1U);
    const Eigen::Vector3d away = toVector(cell) - toVector(*nearest);
    EXPECT_NEAR(away.norm() * map.grid().resolution(), least_m, 1e-9);
    EXPECT_LT((*field.gradientAt(center) * away.norm() - away).norm(), 1e-9);
  });
  return num_near;
}

CellBox smallBox(Random& random) { return test::randomBox(random, kFieldArea, 20); }

TEST(DistanceField, isExactUpToItsBound) {
  Random random(3951);
  std::size_t num_near = 0;
  for (std::size_t i = 0; i < 25; ++i) {
    SCOPED_TRACE(test::seedNote(i));
    CuboidMap map;
    const int count = random.integer(0, 6);
    for (int k = 0; k < count; ++k)
      map.apply(test::randomUpdate(random, {{-3, -3, -2}, {3, 3, 2}}, 3));
    const double bound_m = random.real(0.02, 0.5);
    const auto policy = random.chance(0.3) ? UnknownPolicy::kObstacle : UnknownPolicy::kFree;
    const DistanceField field(map, smallBox(random), bound_m, policy);
    num_near += expectExact(map, field, bound_m, policy);
  }
  EXPECT_GT(num_near, 1000U);
}

TEST(DistanceField, isExactAmongManyObstacles) {
  Random random(3953);
  for (std::size_t i = 0; i < 10; ++i) {
    SCOPED_TRACE(test::seedNote(i));
    CuboidMap map;
    std::vector<UniformBox> boxes;
    const int count = random.integer(20, 400);
    for (int k = 0; k < count; ++k) boxes.push_back({test::randomBox(random, kFieldArea, 4), 1.0F});
    map.replace(kAllCells, boxes);
    const double bound_m = random.real(0.2, 0.5);
    const DistanceField field(map, test::randomBox(random, kFieldArea, 12), bound_m,
                              UnknownPolicy::kFree);
    expectExact(map, field, bound_m, UnknownPolicy::kFree);
  }
}

TEST(DistanceField, followsTheMap) {
  Random random(3952);
  for (std::size_t i = 0; i < 6; ++i) {
    SCOPED_TRACE(test::seedNote(i));
    CuboidMap map;
    const double bound_m = random.real(0.1, 0.4);
    const auto policy = random.chance(0.3) ? UnknownPolicy::kObstacle : UnknownPolicy::kFree;
    DistanceField field(map, smallBox(random), bound_m, policy);
    for (int k = 0; k < 6; ++k) {
      field.update(map, map.apply(test::randomUpdate(random, {{-3, -3, -2}, {3, 3, 2}}, 3)));
      if (random.chance(0.3))
        field.update(map, map.replace(smallBox(random), std::vector<UniformBox>{}));
      expectExact(map, field, bound_m, policy);
    }
    field.update(map, map.clear());
    expectExact(map, field, bound_m, policy);
  }
}

TEST(DistanceField, answersForPoints) {
  CuboidMap map;
  map.replace(kAllCells, std::vector<UniformBox>{{{{0, 0, 0}, {1, 10, 10}}, 1.0F}});
  const DistanceField field(map, {{-50, 0, 0}, {50, 10, 10}}, 2.0, UnknownPolicy::kFree);
  EXPECT_NEAR(*field.distanceAt({1.01, 0.2, 0.2}), 1.0, 1e-9);
  EXPECT_EQ(*field.gradientAt({1.01, 0.2, 0.2}), Eigen::Vector3d(Eigen::Vector3d::UnitX()));
  EXPECT_EQ(*field.gradientAt({-1.01, 0.2, 0.2}), Eigen::Vector3d(-Eigen::Vector3d::UnitX()));
  EXPECT_EQ(*field.distanceAt({0.01, 0.2, 0.2}), 0.0);
  EXPECT_EQ(*field.gradientAt({0.01, 0.2, 0.2}), Eigen::Vector3d(Eigen::Vector3d::Zero()));
  EXPECT_EQ(*field.distanceAt({2.3, 0.2, 0.2}), kInfinity);
  EXPECT_FALSE(field.distanceAt({2.6, 0.2, 0.2}));
  EXPECT_FALSE(field.gradientAt({0.0, 0.2, std::nan("")}));
}

TEST(DistanceField, refusesRegionsAndBoundsThatCannotBe) {
  const CuboidMap map;
  const CellBox region{{0, 0, 0}, {9, 9, 9}};
  for (const double bound_m : {0.0, -1.0, std::nan(""), kInfinity, 51.0}) {
    EXPECT_THROW(DistanceField(map, region, bound_m, UnknownPolicy::kFree), std::invalid_argument)
        << bound_m;
  }
  EXPECT_THROW(DistanceField(map, {}, 1.0, UnknownPolicy::kFree), std::invalid_argument);
  EXPECT_THROW(DistanceField(map, kAllCells, 1.0, UnknownPolicy::kFree), std::invalid_argument);
}

}  // namespace
}  // namespace cuboid_mapping
