// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/motion_query.h"

#include "cuboid_mapping/query/path_query.h"
#include "support/bodies.h"
#include "support/random_bricks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace cuboid_mapping {
namespace {

using test::boxBody;
using test::Random;
using test::yawed;

constexpr double kVoxel_m = 0.25;

MapConfig motionConfig() {
  MapConfig config;
  config.resolution_m = kVoxel_m;
  return config;
}

/// Poses on the way, with Eigen's interpolation of quaternions.
std::vector<Eigen::Isometry3d> samplesOf(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to,
                                         double last, int num_samples) {
  const Eigen::Quaterniond start(from.linear());
  const Eigen::Quaterniond end(to.linear());
  std::vector<Eigen::Isometry3d> samples;
  for (int i = 0; i <= num_samples; ++i) {
    const double part = last * i / num_samples;
    samples.emplace_back(
        Eigen::Translation3d(from.translation() + part * (to.translation() - from.translation())) *
        start.slerp(part, end));
  }
  return samples;
}

bool areFree(const CuboidMap& map, const Body& body, const std::vector<Eigen::Isometry3d>& poses,
             UnknownPolicy policy) {
  for (const auto& contact : checkPoses(map, body, poses, policy, Budget::unlimited())) {
    if (!contact.isNotFound()) return false;
  }
  return true;
}

TEST(MotionQuery, IsNeverFreeWhereAVoxelIsMetAndElseFreeBesidesItsTolerance) {
  Random random(3950);
  int num_free = 0;
  int num_blocked = 0;
  int num_between = 0;
  constexpr int kSamples = 3000;
  for (int round = 0; round < 400; ++round) {
    const CuboidMap map = test::mapOfUpdates(random, 6, motionConfig());
    const UnknownPolicy policy =
        random.chance(0.1) ? UnknownPolicy::kObstacle : UnknownPolicy::kFree;
    const Body body = test::randomBody(random, kVoxel_m);
    const Eigen::Isometry3d from = test::randomTurnedPose(random, 2.5);
    Eigen::Isometry3d to = test::randomTurnedPose(random, 2.5);
    if (random.chance(0.3)) to.translation() = from.translation();
    if (random.chance(0.3)) to.linear() = from.linear();
    const auto result = checkMotion(map, body, {from, to}, policy, Budget::unlimited());
    if (result.status == AnswerStatus::kInvalid) continue;  // It is half a turn.
    const double length_m = lengthOf({from, to});
    if (result.isNotFound()) {
      ++num_free;
      EXPECT_TRUE(areFree(map, body, samplesOf(from, to, 1.0, kSamples), policy)) << round;
      continue;
    }
    ++num_blocked;
    ASSERT_TRUE(result.isFound()) << round;
    // The body is free up to there, but for its touch; and meets the voxel, or nearly.
    if (length_m > 0.0) {
      const double part = result->distance_m / length_m;
      EXPECT_TRUE(areFree(map, test::grown(body, -1e-7),
                          samplesOf(from, to, std::max(0.0, part - 1e-9), kSamples), policy) ||
                  part == 0.0)
          << round;
    }
    const Body larger = test::grown(body, 4.0 * kMotionTolerance * kVoxel_m);
    EXPECT_FALSE(areFree(map, larger, {result->T_map_body}, policy)) << round;
    // Motions with room on all sides are free.
    const bool has_room = areFree(map, larger, samplesOf(from, to, 1.0, kSamples), policy);
    EXPECT_FALSE(has_room) << round;
    num_between += areFree(map, body, samplesOf(from, to, 1.0, kSamples), policy) ? 1 : 0;
  }
  EXPECT_GT(num_free, 40);
  EXPECT_GT(num_blocked, 100);
  EXPECT_LT(num_between, 0.05 * num_blocked) << "refused, but free";
}

/// A free room of 4 x 4 x 4 m.
CuboidMap makeHall() {
  CuboidMap map(motionConfig());
  map.replace(kAllCells, {{{{-8, -8, -8}, {8, 8, 8}}, -1.0F}});
  return map;
}

TEST(MotionQuery, FindsWhatABarMeetsWhileItTurns) {
  CuboidMap map = makeHall();
  map.replace({{3, 3, -8}, {4, 4, 8}}, {{{{3, 3, -8}, {4, 4, 8}}, 1.0F}});  // A post at 45 degrees.
  const Body bar = boxBody({2.5, 0.25, 0.25});
  const auto along = yawed({0, 0, 0}, 0.0);
  const auto across = yawed({0, 0, 0}, M_PI / 2);
  EXPECT_TRUE(areFree(map, bar, {along, across}, UnknownPolicy::kObstacle));
  const auto result =
      checkMotion(map, bar, {along, across, along}, UnknownPolicy::kObstacle, Budget::unlimited());
  ASSERT_TRUE(result.isFound());
  EXPECT_EQ(result->segment, 0U);
  EXPECT_EQ(result->contact.voxel.x, 3);
  const double yaw = std::atan2(result->T_map_body(1, 0), result->T_map_body(0, 0));
  EXPECT_GT(yaw, 0.5);
  EXPECT_LT(yaw, M_PI / 4);
  // The other way round there is none.
  EXPECT_TRUE(checkMotion(map, bar,
                          {along, yawed({0, 0, 0}, -M_PI / 4), yawed({0, 0, 0}, -M_PI / 2)},
                          UnknownPolicy::kObstacle, Budget::unlimited())
                  .isNotFound());
}

TEST(MotionQuery, IsExactAlongEdgesAndNeedsItsToleranceInATurn) {
  const CuboidMap hall = makeHall();
  const auto is_free = [&](const Body& body, const Eigen::Isometry3d& from,
                           const Eigen::Isometry3d& to) {
    return checkMotion(hall, body, {from, to}, UnknownPolicy::kObstacle, Budget::unlimited())
        .isNotFound();
  };
  // As wide and high as the hall, from wall to wall.
  const Body wall = boxBody({1.0, 4.0, 4.0});
  EXPECT_TRUE(is_free(wall, yawed({-1.5, 0, 0}, 0.0), yawed({1.5, 0, 0}, 0.0)));
  EXPECT_FALSE(is_free(wall, yawed({-1.5, 0, 0}, 0.0), yawed({1.501, 0, 0}, 0.0)));
  // Turns do not count along their axis: a body of the hall's height may turn.
  const double gap_m = 2.0 * kMotionTolerance * kVoxel_m;
  const auto square = [](double diagonal_m) {
    return boxBody({diagonal_m / M_SQRT2, diagonal_m / M_SQRT2, 4.0});
  };
  EXPECT_TRUE(is_free(square(4.0 - gap_m), yawed({0, 0, 0}, 0.2), yawed({0, 0, 0}, 2.0)));
  EXPECT_FALSE(is_free(square(4.001), yawed({0, 0, 0}, 0.2), yawed({0, 0, 0}, 2.0)));
}

TEST(MotionQuery, AgreesWithABoxThatDoesNotTurn) {
  Random random(3951);
  for (int round = 0; round < 300; ++round) {
    const CuboidMap map = test::mapOfUpdates(random, 6, motionConfig());
    const Eigen::Vector3d size_m(random.real(0.1, 1.0), random.real(0.1, 1.0),
                                 random.real(0.1, 1.0));
    Eigen::Vector3d to = test::randomPoint(random, 2.5);
    const Eigen::Vector3d from = test::randomPoint(random, 2.5);
    for (int axis = 0; axis < 3; ++axis) {  // It moves along one edge.
      if (axis != round % 3) to[axis] = from[axis];
    }
    const auto straight =
        checkPath(map, {from, to}, size_m, UnknownPolicy::kFree, Budget::unlimited());
    const auto motion = checkMotion(map, boxBody(size_m), {yawed(from, 0.0), yawed(to, 0.0)},
                                    UnknownPolicy::kFree, Budget::unlimited());
    ASSERT_EQ(motion.isNotFound(), straight.isNotFound()) << round;
    if (!motion.isFound()) continue;
    EXPECT_NEAR(motion->distance_m, straight->distance_m, 2.0 * kMotionTolerance * kVoxel_m);
    EXPECT_LE(motion->distance_m, straight->distance_m + 1e-6);
  }
}

TEST(MotionQuery, SaysWhatIsWrong) {
  const CuboidMap hall = makeHall();
  const Body bar = boxBody({2.5, 0.25, 0.25});
  const auto here = yawed({0, 0, 0}, 0.3);
  const auto expect_fault = [&](const Body& body, const std::vector<Eigen::Isometry3d>& poses,
                                const std::string& part) {
    const std::string text = findFault(body, poses, hall.grid());
    EXPECT_NE(text.find(part), std::string::npos) << "says: " << text;
    EXPECT_EQ(checkMotion(hall, body, poses, UnknownPolicy::kFree, Budget::unlimited()).status,
              AnswerStatus::kInvalid);
  };
  expect_fault({}, {here}, "no part");
  expect_fault(boxBody({3000, 1, 1}), {here}, "in metres");
  expect_fault(bar, {}, "no poses");
  expect_fault(bar, {here, yawed({NAN, 0, 0}, 0.0)}, "poses[1] must be finite");
  expect_fault(bar, {yawed({1e12, 0, 0}, 0.0)}, "range of the grid");
  Eigen::Isometry3d scaled = here;
  scaled.linear() *= 1.01;
  expect_fault(bar, {scaled}, "quaternion of length 1");
  expect_fault(bar, {here, here, yawed({1, 0, 0}, 0.3 + M_PI)},
               "poses[1] to poses[2] is half a turn");
  EXPECT_EQ(findFault(bar, {here, yawed({1, 0, 0}, 0.31 + M_PI)}, hall.grid()), "");
  EXPECT_TRUE(
      checkMotion(hall, bar, {here}, UnknownPolicy::kFree, Budget::unlimited()).isNotFound());
}

TEST(MotionQuery, TakesTurnsWithOthers) {
  int num_turns = 0;
  Budget budget(QueryLimits{}, {[&num_turns] { ++num_turns; }, 0.0});
  EXPECT_TRUE(checkMotion(makeHall(), boxBody({0.5, 0.5, 0.5}),
                          {yawed({0, 0, 0}, 0.0), yawed({1e4, 0, 0}, 1.0)}, UnknownPolicy::kFree,
                          budget)
                  .isNotFound());
  EXPECT_GT(num_turns, 10);
}

TEST(MotionQuery, EndsWithItsBudget) {
  const CuboidMap hall = makeHall();
  QueryLimits limits;
  limits.max_bricks = 50;
  Budget budget(limits);
  const auto result =
      checkMotion(hall, boxBody({0.5, 0.5, 0.5}), {yawed({0, 0, 0}, 0.0), yawed({1e6, 0, 0}, 1.0)},
                  UnknownPolicy::kFree, budget);
  EXPECT_EQ(result.status, AnswerStatus::kBudgetSpent);
  EXPECT_FALSE(result.isFound());
}

}  // namespace
}  // namespace cuboid_mapping
