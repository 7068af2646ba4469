// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/sphere_query.h"

#include "cuboid_mapping/query/path_query.h"
#include "support/random_bricks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <thread>
#include <utility>
#include <vector>

namespace cuboid_mapping {
namespace {

using test::Random;

/// Edge of a voxel: nothing is rounded.
constexpr double kSphereEdge_m = 0.25;

MapConfig sphereConfig() {
  MapConfig config;
  config.resolution_m = kSphereEdge_m;
  return config;
}

/// Greatest depth of a ball in an obstacle, voxels; <= 0: in none. Looks at every voxel around.
double depthOf(const CuboidMap& map, UnknownPolicy policy, const Sphere& sphere) {
  const Eigen::Vector3d center = sphere.center_map / kSphereEdge_m;
  const auto around = map.grid().toCellBox(boxAround(
      sphere.center_map, Eigen::Vector3d::Constant(2.0 * (sphere.radius_m + kSphereEdge_m))));
  double depth = -std::numeric_limits<double>::infinity();
  test::visitCells(*around, [&](const Cell& cell) {
    const Occupancy occupancy = map.voxels().at(cell);
    if (occupancy == Occupancy::kFree) return;
    if (occupancy == Occupancy::kUnknown && policy == UnknownPolicy::kFree) return;
    const Eigen::Vector3d low = toVector(cell);
    const Eigen::Vector3d nearest = center.cwiseMax(low).cwiseMin((low.array() + 1.0).matrix());
    depth = std::max(depth, sphere.radius_m / kSphereEdge_m - (center - nearest).norm());
  });
  return depth;
}

/// Balls of some radii along links, as those of an arm; a few of them large.
std::vector<Sphere> randomArm(Random& random) {
  std::vector<Sphere> spheres;
  Eigen::Vector3d place = test::randomPoint(random, 6.0);
  Eigen::Vector3d step = Eigen::Vector3d::Zero();
  for (int i = 0; i < 40; ++i) {
    if (i % 10 == 0) step = random.real(0.0, 2.0) * kSphereEdge_m * test::randomDirection(random);
    const double radius = random.chance(0.02) ? random.real(12.0, 18.0) : random.real(0.2, 6.0);
    spheres.push_back({place += step, radius * kSphereEdge_m});
  }
  return spheres;
}

TEST(SphereQuery, AnswersInOtherThreadsThanTheOneThatMadeIt) {
  Random random(4391);
  CuboidMap map(sphereConfig());
  map.apply(test::randomUpdate(random, {{-2, -2, -1}, {2, 2, 1}}, 16));
  const std::vector<Sphere> spheres = randomArm(random);
  const auto expected =
      SphereChecker(map, UnknownPolicy::kFree, Budget::unlimited()).check(spheres);
  std::vector<SphereChecker> checkers;
  std::thread([&] {
    for (int i = 0; i < 3; ++i)
      checkers.emplace_back(map, UnknownPolicy::kFree, Budget::unlimited());
  }).join();
  std::vector<std::thread> threads;
  for (SphereChecker& checker : checkers) {
    threads.emplace_back([&] { EXPECT_EQ(checker.check(spheres), expected); });
  }
  for (std::thread& thread : threads) thread.join();
}

TEST(SphereQuery, FindsEveryVoxelThatABallMeetsWhileTheMapChanges) {
  Random random(4390);
  int num_free = 0;
  int num_blocked = 0;
  for (int round = 0; round < 40; ++round) {
    CuboidMap map(sphereConfig());
    const UnknownPolicy policy =
        random.chance(0.3) ? UnknownPolicy::kObstacle : UnknownPolicy::kFree;
    SphereChecker checker(map, policy, Budget::unlimited());
    for (int batch = 0; batch < 6; ++batch) {
      if (batch % 2 == 0) map.apply(test::randomUpdate(random, {{-2, -2, -1}, {2, 2, 1}}, 16));
      const std::vector<Sphere> spheres = randomArm(random);
      const std::vector<AnswerStatus> answers = checker.check(spheres);
      ASSERT_EQ(answers.size(), spheres.size());
      for (std::size_t i = 0; i < spheres.size(); ++i) {
        const double depth = depthOf(map, policy, spheres[i]);
        if (std::abs(depth) < 1e-5) continue;  // It only touches.
        EXPECT_EQ(answers[i], depth < 0.0 ? AnswerStatus::kNotFound : AnswerStatus::kFound)
            << "round " << round << ", batch " << batch << ", ball " << i << ", depth " << depth;
        depth < 0.0 ? ++num_free : ++num_blocked;
      }
    }
  }
  EXPECT_GT(num_free, 1000);
  EXPECT_GT(num_blocked, 1000);
}

/// The large balls read so many bricks that those of the small ones are forgotten.
TEST(SphereQuery, KnowsTheObstaclesOfSmallBallsAmongLargeOnes) {
  CuboidMap map(sphereConfig());
  std::vector<UniformBox> corners;
  forEachBrick({{-40, -40, -40}, {40, 40, 40}}, [&](const Cell& brick) {
    corners.push_back({{brick, brick + Cell{1, 1, 1}}, 1.0F});
  });
  map.replace({{-40, -40, -40}, {40, 40, 40}}, corners);
  SphereChecker checker(map, UnknownPolicy::kFree, Budget::unlimited());
  Random random(16);
  const Sphere small{{0.45, 0.45, 0.45}, 0.4};  // Meets voxel (0, 0, 0).
  for (int i = 0; i < 400; ++i) {
    const Sphere large{test::randomPoint(random, 6.0), 17.0 * kSphereEdge_m};
    const std::vector<AnswerStatus> answers = checker.check({small, large});
    for (const auto& [sphere, answer] :
         {std::pair(small, answers[0]), std::pair(large, answers[1])}) {
      const bool is_free = depthOf(map, UnknownPolicy::kFree, sphere) < 0.0;
      ASSERT_EQ(answer, is_free ? AnswerStatus::kNotFound : AnswerStatus::kFound) << "round " << i;
    }
  }
}

TEST(SphereQuery, FollowsAnEditBesideABallThatWasFree) {
  CuboidMap map(sphereConfig());
  const std::vector<Sphere> spheres{{{1.0, 1.0, 1.0}, 0.5}, {{1.1, 1.0, 1.0}, 0.5}};
  SphereChecker checker(map, UnknownPolicy::kFree, Budget::unlimited());
  EXPECT_EQ(checker.check(spheres), std::vector<AnswerStatus>(2, AnswerStatus::kNotFound));
  map.replace({{5, 3, 3}, {6, 5, 5}}, {{{{5, 3, 3}, {6, 5, 5}}, 1.0F}});
  EXPECT_EQ(checker.check(spheres), std::vector<AnswerStatus>(2, AnswerStatus::kFound));
  map.replace({{5, 3, 3}, {6, 5, 5}}, std::vector<UniformBox>());
  EXPECT_EQ(checker.check(spheres), std::vector<AnswerStatus>(2, AnswerStatus::kNotFound));
}

TEST(SphereQuery, SaysWhichBallsAreNone) {
  const CuboidMap map(sphereConfig());
  SphereChecker checker(map, UnknownPolicy::kFree, Budget::unlimited());
  const std::vector<Sphere> wrong{{{NAN, 0.0, 0.0}, 1.0},  {{0.0, 0.0, INFINITY}, 1.0},
                                  {{1e12, 0.0, 0.0}, 1.0}, {{0.0, 0.0, 0.0}, 0.0},
                                  {{0.0, 0.0, 0.0}, -1.0}, {{0.0, 0.0, 0.0}, NAN},
                                  {{0.0, 0.0, 0.0}, 2e3}};
  EXPECT_EQ(checker.check(wrong), std::vector<AnswerStatus>(wrong.size(), AnswerStatus::kInvalid));
  EXPECT_EQ(checker.check({wrong[0], {{0.0, 0.0, 0.0}, 1.0}}),
            (std::vector<AnswerStatus>{AnswerStatus::kInvalid, AnswerStatus::kNotFound}));
}

TEST(SphereQuery, EndsWithItsBudget) {
  const CuboidMap map(sphereConfig());
  QueryLimits limits;
  limits.max_bricks = 10;
  Budget budget(limits);
  SphereChecker checker(map, UnknownPolicy::kFree, budget);
  const std::vector<AnswerStatus> answers =
      checker.check({{{1.0, 1.0, 1.0}, 0.5}, {{9.0, 1.0, 1.0}, 3.0}, {{1.0, 1.0, 1.0}, 0.5}});
  EXPECT_EQ(answers, (std::vector<AnswerStatus>{AnswerStatus::kNotFound, AnswerStatus::kBudgetSpent,
                                                AnswerStatus::kBudgetSpent}));
}

TEST(SphereQuery, IsAsBeforeAfterASpentBudget) {
  CuboidMap map(sphereConfig());
  const CellBox wall{{9, 0, 0}, {10, 8, 8}};
  map.replace(wall, {{wall, 1.0F}});
  const std::vector<Sphere> spheres{{{1.875, 1.0, 1.0}, 0.5}, {{1.5, 1.0, 1.0}, 0.5}};
  const std::vector<AnswerStatus> expected{AnswerStatus::kFound, AnswerStatus::kNotFound};
  for (std::uint64_t max_bricks = 1; max_bricks < 12; ++max_bricks) {
    QueryLimits limits;
    limits.max_bricks = max_bricks;
    Budget budget(limits);
    SphereChecker checker(map, UnknownPolicy::kFree, budget);
    (void)checker.check(spheres);
    budget = Budget();
    EXPECT_EQ(checker.check(spheres), expected) << max_bricks << " bricks before";
  }
}

}  // namespace
}  // namespace cuboid_mapping
