// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/fit_query.h"

#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/query/fit_field.h"
#include "cuboid_mapping/query/path_query.h"
#include "support/dense_obstacles.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace cuboid_mapping {
namespace {

using test::DenseObstacles;
using test::Random;

constexpr CellBox kArea{{-16, -16, -16}, {16, 16, 16}};

MapConfig fitConfig() {
  MapConfig config;
  config.resolution_m = 1.0;
  return config;
}

TEST(Obstacles, areThoseOfEveryVoxel) {
  Random random(81);
  const test::ModelledMap model = test::randomRooms(random, fitConfig(), kArea);
  std::size_t num_any = 0;
  for (const UnknownPolicy policy : {UnknownPolicy::kObstacle, UnknownPolicy::kFree}) {
    DenseObstacles expected(model.voxels, kArea, policy);
    const Obstacles obstacles(model.map, policy, Budget::unlimited());
    for (std::size_t i = 0; i < 5000; ++i) {
      const CellBox box = test::randomBox(random, {{-20, -20, -20}, {20, 20, 20}}, 6);
      const bool is_any = expected.isAny(box);
      ASSERT_EQ(obstacles.isAny(box), is_any) << box << test::seedNote(i);
      num_any += is_any ? 1 : 0;
      if (i % 10 != 0) continue;
      std::size_t num_visited = 0;
      obstacles.visit(box, [&](const Cell& cell) {
        ASSERT_TRUE(box.contains(cell) && expected.isAny(CellBox::ofCell(cell)));
        ++num_visited;
      });
      std::size_t num_expected = 0;
      test::visitCells(box, [&](const Cell& cell) {
        num_expected += expected.isAny(CellBox::ofCell(cell)) ? 1 : 0;
      });
      ASSERT_EQ(num_visited, num_expected) << box << test::seedNote(i);
    }
  }
  EXPECT_GT(num_any, 1000U);
  EXPECT_LT(num_any, 9500U);
}

TEST(FitField, hasThePlacesWhereTheBoxMeetsNothing) {
  Random random(82);
  std::size_t num_fitting = 0;
  std::size_t num_cases = 0;
  for (int m = 0; m < 40; ++m) {
    const UnknownPolicy policy = m % 2 == 0 ? UnknownPolicy::kObstacle : UnknownPolicy::kFree;
    const test::ModelledMap model = test::randomRooms(random, fitConfig(), kArea);
    DenseObstacles expected(model.voxels, kArea, policy);
    const Obstacles obstacles(model.map, policy, Budget::unlimited());
    const int max_edge = m % 4 == 3 ? 20 : 5;
    const Cell size{random.integer(1, max_edge), random.integer(1, max_edge),
                    random.integer(1, max_edge)};
    FitField field(obstacles, size);
    for (int i = 0; i < 1000; ++i, ++num_cases) {
      const Cell place = test::randomCell(random, {{-24, -24, -24}, {20, 20, 20}});
      const bool fits = !expected.isAny({place, place + size});
      ASSERT_EQ(field.fits(place), fits) << place << size << test::seedNote(num_cases);
      num_fitting += fits ? 1 : 0;
    }
    const CellBox places{{1, 2, 3}, {4, 3, 9}};
    EXPECT_EQ(field.placesIn(field.coveredAt(places)), places);
  }
  EXPECT_GT(num_fitting, num_cases / 10);
  EXPECT_LT(num_fitting, num_cases * 9 / 10);
}

/// A box of 100 voxels reaches 14 x 14 x 14 bricks from one.
TEST(FitField, readsOneLayerOfBricksWhereThatLeavesNoPlace) {
  CuboidMap map(fitConfig());
  QueryLimits limits;
  limits.max_bricks = 1000;
  Budget budget(limits);
  const Obstacles obstacles(map, UnknownPolicy::kObstacle, budget);
  FitField field(obstacles, {100, 100, 100});
  EXPECT_FALSE(field.fits({0, 0, 0}));
  EXPECT_FALSE(budget.isSpent());
}

TEST(FitQuery, isThePointItselfWhereTheBoxFits) {
  for (const double resolution_m : {1.0, 0.1}) {
    MapConfig config;
    config.resolution_m = resolution_m;
    CuboidMap map(config);
    map.replace(kAllCells, {{{{0, 0, 0}, {100, 100, 100}}, -1.0F}});
    const Eigen::Vector3d point(3.3, 4.83, 5.5);
    const auto found =
        findNearestFit(map, point, {2, 2, 2}, UnknownPolicy::kObstacle, 0.0, Budget::unlimited());
    ASSERT_TRUE(found.isFound());
    EXPECT_EQ(found->center_map, point);
    EXPECT_EQ(found->distance_m, 0.0);
  }
}

TEST(FitQuery, isAtTheWallForABoxThatWouldReachBehindIt) {
  CuboidMap map(fitConfig());
  map.replace(kAllCells, {{{{0, 0, 0}, {10, 10, 10}}, -1.0F}});
  const auto found = findNearestFit(map, {-1.0, 5.0, 9.9}, {2, 3, 1.5}, UnknownPolicy::kObstacle,
                                    20.0, Budget::unlimited());
  ASSERT_TRUE(found.isFound());
  EXPECT_NEAR((found->center_map - Eigen::Vector3d(1.0, 5.0, 9.25)).norm(), 0.0, 1e-9);
}

TEST(FitQuery, doesNotSearchBeyondWhatIsKnownWhereTheUnknownIsAnObstacle) {
  MapConfig config = fitConfig();
  config.resolution_m = 0.05;
  CuboidMap map(config);
  Budget of_nothing{QueryLimits{}};
  EXPECT_TRUE(findNearestFit(map, {0, 0, 0}, {1, 1, 1}, UnknownPolicy::kObstacle, 100.0, of_nothing)
                  .isNotFound());
  EXPECT_FALSE(of_nothing.isSpent());
  map.replace(kAllCells, {UniformBox{{{0, 0, 0}, {16, 16, 16}}, -1.0F}});
  QueryLimits limits;
  limits.max_bricks = 1000000;  // A search of 100 m takes about 1e9.
  Budget of_few(limits);
  EXPECT_TRUE(findNearestFit(map, {0, 0, 0}, {1, 1, 1}, UnknownPolicy::kObstacle, 100.0, of_few)
                  .isNotFound());
  EXPECT_FALSE(of_few.isSpent());
  limits.max_bricks = 1000;
  Budget of_map(limits);
  const auto far = findNearestFit(map, {1000, 0.4, 0.4}, Eigen::Vector3d::Constant(0.5),
                                  UnknownPolicy::kObstacle, 2000.0, of_map);
  ASSERT_TRUE(far.isFound());
  EXPECT_NEAR(far->distance_m, 999.45, 1e-6);
}

TEST(FitQuery, isNothingWhereNoneIsNearOrTheQuestionIsBad) {
  CuboidMap map(fitConfig());
  map.replace(kAllCells, {{{{0, 0, 0}, {10, 10, 10}}, -1.0F}});
  const auto find = [&](const Eigen::Vector3d& point, const Eigen::Vector3d& size_m, double max_m) {
    return findNearestFit(map, point, size_m, UnknownPolicy::kObstacle, max_m, Budget::unlimited())
        .isFound();
  };
  EXPECT_FALSE(find({5, 5, 5}, {10.5, 1, 1}, 50.0)) << "larger than the room";
  EXPECT_TRUE(find({5, 5, 5}, {10.0, 1, 1}, 50.0)) << "equal to it";
  EXPECT_FALSE(find({-5, 5, 5}, {1, 1, 1}, 5.0));
  EXPECT_TRUE(find({-5, 5, 5}, {1, 1, 1}, 5.5));
  EXPECT_FALSE(find({5, 5, 5}, {0, 1, 1}, 5.0));
  EXPECT_FALSE(find({5, 5, std::nan("")}, {1, 1, 1}, 5.0));
  EXPECT_FALSE(find({5, 5, 5}, {1, 1, 1}, -1.0));
  EXPECT_FALSE(find({5, 5, 5}, {1, 1, 1}, std::nan("")));
  EXPECT_FALSE(find({5, 5, 5}, {1, 1, 1}, 1e12));
}

/// Possible coordinates of the nearest centre: the point's own, or such that a face of the box
/// lies on one of the voxel faces near it.
std::vector<double> candidates(double coordinate, double half, double reach) {
  std::vector<double> values{coordinate};
  for (double face = std::floor(coordinate - reach - half); face <= coordinate + reach + half;
       ++face) {
    for (const double value : {face - half, face + half}) {
      if (std::abs(value - coordinate) <= reach) values.push_back(value);
    }
  }
  return values;
}

/// Squared distance of the nearest place, or of `reach` if there is none.
double findBySearch(DenseObstacles& obstacles, const Grid& grid, const Eigen::Vector3d& point,
                    const Eigen::Vector3d& size, double reach) {
  double best = reach * reach;
  std::vector<double> values[3];
  for (int axis = 0; axis < 3; ++axis) {
    values[axis] = candidates(point[axis], 0.5 * size[axis], reach);
  }
  for (const double x : values[0]) {
    for (const double y : values[1]) {
      const double squared_xy =
          (x - point.x()) * (x - point.x()) + (y - point.y()) * (y - point.y());
      if (squared_xy >= best) continue;
      for (const double z : values[2]) {
        const double squared = squared_xy + (z - point.z()) * (z - point.z());
        if (squared >= best) continue;
        if (!obstacles.isAny(*grid.toCellBox(boxAround({x, y, z}, size)))) best = squared;
      }
    }
  }
  return best;
}

TEST(FitQuery, agreesWithALookAtEveryPlace) {
  Random random(83);
  constexpr double kReach = 5.0;
  std::size_t num_cases = 0;
  std::size_t num_moved = 0;
  std::size_t num_none = 0;
  for (int m = 0; m < 20; ++m) {
    const UnknownPolicy policy = m % 2 == 0 ? UnknownPolicy::kObstacle : UnknownPolicy::kFree;
    const test::ModelledMap model = test::randomRooms(random, fitConfig(), kArea);
    DenseObstacles obstacles(model.voxels, kArea, policy);
    for (int i = 0; i < 500; ++i, ++num_cases) {
      const Eigen::Vector3d point = test::randomPoint(random, 18.0);
      Eigen::Vector3d size_m =
          Eigen::Vector3d::Constant(0.5) + 0.25 * test::randomPoint(random, 1.0);
      if (i % 3 == 0) size_m = Eigen::Vector3d(random.integer(1, 5), 2, random.integer(1, 3));
      if (i % 3 == 1) size_m *= random.chance(0.5) ? 5.0 : 15.0;
      const double expected = findBySearch(obstacles, model.map.grid(), point, size_m, kReach);
      const auto found =
          findNearestFit(model.map, point, size_m, policy, kReach, Budget::unlimited());
      if (expected >= kReach * kReach) {
        ASSERT_FALSE(found.isFound()) << test::seedNote(num_cases);
        ++num_none;
        continue;
      }
      ASSERT_TRUE(found.isFound()) << test::seedNote(num_cases);
      ASSERT_NEAR((found->center_map - point).squaredNorm(), expected, 1e-4)
          << test::seedNote(num_cases);
      ASSERT_FALSE(
          obstacles.isAny(*model.map.grid().toCellBox(boxAround(found->center_map, size_m))))
          << test::seedNote(num_cases);
      num_moved += expected > 0.0 ? 1 : 0;
    }
  }
  EXPECT_EQ(num_cases, 10000U);
  EXPECT_GT(num_moved, 2000U);
  EXPECT_GT(num_none, 50U);
}

/// The nearest place is filled while a search lets others change the map, each time at another moment.
TEST(FitQuery, holdsInTheMapAsItIsInTheEndWhenOthersChangeIt) {
  constexpr CellBox kNear{{18, 0, 0}, {21, 3, 3}};
  constexpr CellBox kFar{{-33, 0, 0}, {-30, 3, 3}};
  const Eigen::Vector3d size_m(2.0, 2.0, 2.0);
  int num_changed = 0;
  for (int change_at = 1;; ++change_at) {
    CuboidMap map(fitConfig());
    constexpr CellBox kBlock{{-64, -64, -64}, {64, 64, 64}};
    map.replace(kAllCells, {{kBlock, 1.0F}, {kNear, -1.0F}, {kFar, -1.0F}});
    int num_turns = 0;
    MapUnlock turns;
    turns.period_s = 0.0;
    turns.yield = [&] {
      if (++num_turns == change_at) map.replace(kNear, {{kNear, 1.0F}});
    };
    Budget budget(QueryLimits{}, turns);
    const auto found =
        findNearestFit(map, {0.5, 0.5, 0.5}, size_m, UnknownPolicy::kObstacle, 40.0, budget);
    ASSERT_TRUE(found.isFound()) << change_at;
    const auto box = map.grid().toCellBox(boxAround(found->center_map, size_m));
    ASSERT_TRUE(box && !isAnyOccupied(map, *box)) << "after a change at turn " << change_at;
    if (num_turns < change_at) break;
    ++num_changed;
  }
  EXPECT_GT(num_changed, 5);
}

}  // namespace
}  // namespace cuboid_mapping
