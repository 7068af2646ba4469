// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/obstacle_distance.h"

#include "cuboid_mapping/query/distance_field.h"
#include "support/random_bricks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace cuboid_mapping {
namespace {

using test::Random;

constexpr CellBox kDistanceArea{{-24, -24, -12}, {24, 24, 12}};

TEST(ObstacleDistance, IsThatOfADistanceField) {
  Random random(3951);
  int num_near = 0;
  for (int round = 0; round < 40; ++round) {
    CuboidMap map;
    const int count = random.integer(1, 4);
    for (int i = 0; i < count; ++i) {
      map.apply(test::randomUpdate(random, {{-2, -2, -1}, {2, 2, 1}}, 8));
    }
    const Grid& grid = map.grid();
    const UnknownPolicy policy =
        random.chance(0.3) ? UnknownPolicy::kObstacle : UnknownPolicy::kFree;
    const double bound_m = grid.resolution() * random.real(0.5, 30.0);
    const DistanceField field(map, kDistanceArea, bound_m, policy);
    for (int i = 0; i < 50; ++i) {
      const Cell cell = test::randomCell(random, kDistanceArea);
      const Eigen::Vector3d point = grid.centerOf(CellBox::ofCell(cell));
      const auto found = findObstacleDistance(map, point, bound_m, policy, Budget::unlimited());
      ASSERT_EQ(found.status, std::isinf(field.distanceAt(point).value()) ? AnswerStatus::kNotFound
                                                                          : AnswerStatus::kFound);
      const double distance_m = *field.distanceAt(point);
      if (std::isinf(distance_m)) {
        EXPECT_EQ(found.value.distance_m, distance_m) << "round " << round << ", " << cell;
      } else {
        EXPECT_NEAR(found.value.distance_m, distance_m, 1e-9) << "round " << round << ", " << cell;
        num_near += distance_m > 0.0 ? 1 : 0;
      }
      const bool has_gradient = std::isfinite(distance_m) && distance_m > 0.0;
      EXPECT_NEAR(found.value.gradient_map.norm(), has_gradient ? 1.0 : 0.0, 1e-9);
      if (!has_gradient) continue;
      // The gradient leads to one of the nearest obstacles.
      const auto obstacle = grid.toCell(point - found.value.distance_m * found.value.gradient_map);
      ASSERT_TRUE(obstacle);
      const Eigen::Vector3d center = grid.centerOf(CellBox::ofCell(*obstacle));
      EXPECT_EQ(findObstacleDistance(map, center, bound_m, policy, Budget::unlimited())->distance_m,
                0.0);
    }
  }
  EXPECT_GT(num_near, 300);
}

TEST(ObstacleDistance, RefusesWhatIsNoPointOrNoBound) {
  CuboidMap map;
  map.replace(kAllCells, {UniformBox{{{0, 0, 0}, {4, 4, 4}}, 1.0F}});
  const auto ask = [&](double x, double bound_m) {
    return findObstacleDistance(map, {x, 0.0, 0.0}, bound_m, UnknownPolicy::kFree,
                                Budget::unlimited());
  };
  EXPECT_FALSE(ask(NAN, 1.0).fault.empty());
  EXPECT_FALSE(ask(1e12, 1.0).fault.empty());
  EXPECT_FALSE(ask(1.0, 0.0).fault.empty());
  EXPECT_FALSE(ask(1.0, NAN).fault.empty());
  ASSERT_TRUE(ask(1e7, 1e9).isFound()) << "as far as the grid goes";
  EXPECT_NEAR(ask(1e7, 1e9)->distance_m, 1e7, 1.0);
  EXPECT_TRUE(ask(1e7, 1.0).isNotFound());
  EXPECT_EQ(ask(1e7, 1.0).value.distance_m, std::numeric_limits<double>::infinity());
  Budget budget(QueryLimits{std::numeric_limits<double>::infinity(), 1});
  EXPECT_EQ(findObstacleDistance(map, {9.0, 9.0, 9.0}, 20.0, UnknownPolicy::kFree, budget).status,
            AnswerStatus::kBudgetSpent);
}

}  // namespace
}  // namespace cuboid_mapping
