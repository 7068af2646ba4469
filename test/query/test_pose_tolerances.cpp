// SPDX-License-Identifier: BSD-3-Clause
// Ways of bodies that turn: clearance, starts that touch obstacles, and goals that they cannot reach.
#include "cuboid_mapping/query/pose_path.h"
#include "support/bodies.h"
#include "support/way_end.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace cuboid_mapping {
namespace {

using test::endOf;

constexpr auto kUnknownStops = UnknownPolicy::kObstacle;

/// Two rooms of 2 x 2 x 1 m with a wall between them at x = 2 m that has a door from y = 1 m on; voxels of 0.1 m.
CuboidMap roomsOfDecimetres(int door_voxels) {
  MapConfig config;
  config.resolution_m = 0.1;
  CuboidMap map(config);
  const CellBox wall{{20, 0, 0}, {21, 20, 10}};
  const CellBox door{{20, 10, 0}, {21, 10 + door_voxels, 10}};
  map.replace(kAllCells, {{{{0, 0, 0}, {41, 20, 10}}, -1.0F}});
  map.replace(wall, {{wall, 1.0F}});
  if (door_voxels > 0) map.replace(door, {{door, -1.0F}});
  return map;
}

/// A base of 0.5 x 0.3 m.
PosePathTask betweenTheRooms() {
  PosePathTask task;
  task.body = test::boxBody({0.5, 0.3, 0.3});
  task.start_map = test::yawed({0.6, 0.65, 0.5}, 0.0);
  task.goal_map = test::yawed({3.4, 0.65, 0.5}, 0.0);
  return task;
}

Answer<PosePath> findPoses(const CuboidMap& map, const PosePathTask& task) {
  return findPosePath(map, task, kUnknownStops, Budget::unlimited());
}

/// Where a path crosses the wall, metres along y.
double crossingOf(const PosePath& path) {
  for (std::size_t i = 1; i < path.T_map_body.size(); ++i) {
    const Eigen::Vector3d from = path.T_map_body[i - 1].translation();
    const Eigen::Vector3d to = path.T_map_body[i].translation();
    if (from.x() > 2.05 || to.x() < 2.05) continue;
    return from.y() + (2.05 - from.x()) / (to.x() - from.x()) * (to.y() - from.y());
  }
  return std::nan("");
}

TEST(PoseClearance, APathTakesTheMiddleOfAWideDoorAndANarrowOneAnyhow) {
  PosePathTask task = betweenTheRooms();
  const auto grazing = findPoses(roomsOfDecimetres(9), task);
  ASSERT_EQ(endOf(grazing), "found");
  EXPECT_LT(crossingOf(*grazing), 1.3) << "beside the post at y = 1";
  task.clearance_m = 0.3;
  const auto middle = findPoses(roomsOfDecimetres(9), task);
  ASSERT_EQ(endOf(middle), "found");
  EXPECT_NEAR(crossingOf(*middle), 1.45, 0.08) << "of a door from 1.0 to 1.9";
  EXPECT_TRUE(checkMotion(roomsOfDecimetres(9), task.body, middle->T_map_body, kUnknownStops,
                          Budget::unlimited())
                  .isNotFound());
  EXPECT_EQ(endOf(findPoses(roomsOfDecimetres(4), task)), "found");
  EXPECT_EQ(endOf(findPoses(roomsOfDecimetres(2), task)), "between");
}

TEST(PoseClearance, ThatNoRoomHasIsAsGoodAsAnyOther) {
  PosePathTask task = betweenTheRooms();
  task.clearance_m = 50.0;
  const auto expected = findPoses(roomsOfDecimetres(9), task);
  for (const double clearance_m : {1e5, 3e8, 1e9, 1e12, 1e300}) {
    task.clearance_m = clearance_m;
    const auto path = findPoses(roomsOfDecimetres(9), task);
    ASSERT_EQ(endOf(path), "found");
    EXPECT_EQ(path->T_map_body.size(), expected->T_map_body.size()) << clearance_m;
    EXPECT_EQ(path->length_m, expected->length_m) << clearance_m;
  }
}

TEST(PoseTolerances, ABaseLeavesAWallThatItTouches) {
  PosePathTask task = betweenTheRooms();
  task.start_map = test::yawed({1.73, 0.5, 0.5}, 0.2);
  const CuboidMap rooms = roomsOfDecimetres(6);
  EXPECT_EQ(endOf(findPoses(rooms, task)), "start");
  task.start_tolerance_m = 0.4;
  const auto left = findPoses(rooms, task);
  ASSERT_EQ(endOf(left), "found");
  EXPECT_GT(left->start_distance_m, 0.0);
  EXPECT_LE(left->start_distance_m, 0.4);
  ASSERT_TRUE(left->met);
  EXPECT_EQ(left->met->x, 20);
  EXPECT_TRUE(left->T_map_body.front().isApprox(task.start_map));
  EXPECT_TRUE(left->T_map_body.back().isApprox(task.goal_map));
  const std::vector<Eigen::Isometry3d> rest(left->T_map_body.begin() + 1, left->T_map_body.end());
  EXPECT_TRUE(checkMotion(rooms, task.body, rest, kUnknownStops, Budget::unlimited()).isNotFound());
  task.start_tolerance_m = 2.0;
  EXPECT_EQ(endOf(findPoses(roomsOfDecimetres(0), task)), "between") << "not through the wall";
  task.start_map = test::yawed({2.05, 0.5, 0.5}, 0.2);
  EXPECT_EQ(endOf(findPoses(rooms, task)), "start") << "in the middle of the wall";
}

TEST(PoseTolerances, ABaseThatStaysAtItsHeightTakesAGoalNearlyAVoxelHigher) {
  PosePathTask task = betweenTheRooms();
  task.goal_map.translation().z() = 0.6;  // 0.6 - 0.5 < 0.1 in float64.
  const CuboidMap rooms = roomsOfDecimetres(6);
  const auto found = findPoses(rooms, task);
  ASSERT_EQ(endOf(found), "found");
  EXPECT_TRUE(found->T_map_body.back().isApprox(task.goal_map));
  task.goal_map.translation().x() = 2.1;
  EXPECT_EQ(endOf(findPoses(rooms, task)), "goal");
  task.goal_tolerance_m = 0.5;
  EXPECT_EQ(endOf(findPoses(rooms, task)), "found");
}

TEST(PoseTolerances, WaysOutHoldInTheMapAsItIsInTheEndWhenOthersChangeIt) {
  CuboidMap flat = roomsOfDecimetres(6);
  flat.replace({{0, 0, 0}, {12, 20, 10}}, std::vector<UniformBox>());
  PosePathTask turning = betweenTheRooms();
  turning.start_tolerance_m = 1.2;
  const int num_poses = test::changeDuringSearch(
      flat, {{10, 0, 0}, {11, 20, 10}}, [&](const CuboidMap& map, Budget& budget) {
        return findPosePath(map, turning, kUnknownStops, budget);
      });
  EXPECT_GT(num_poses, 5);
}

TEST(PoseTolerances, ABaseGoesAsNearToAGoalAsItGets) {
  PosePathTask task = betweenTheRooms();
  task.goal_map = test::yawed({2.2, 0.65, 0.5}, 0.0);
  const CuboidMap rooms = roomsOfDecimetres(6);
  EXPECT_EQ(endOf(findPoses(rooms, task)), "goal");
  task.goal_tolerance_m = 0.3;
  const auto moved = findPoses(rooms, task);
  ASSERT_EQ(endOf(moved), "found");
  EXPECT_NEAR(moved->goal_distance_m, 0.15, 1e-9) << "the next lattice place is at 2.35 m";
  EXPECT_EQ(endOf(findPoses(roomsOfDecimetres(0), task)), "between");
  task.goal_tolerance_m = std::numeric_limits<double>::infinity();
  const auto near = findPoses(roomsOfDecimetres(0), task);
  ASSERT_EQ(endOf(near), "found");
  EXPECT_LT(near->goal_distance_m, 0.6);
  EXPECT_TRUE(checkMotion(roomsOfDecimetres(0), task.body, near->T_map_body, kUnknownStops,
                          Budget::unlimited())
                  .isNotFound());
  task.goal_map = test::yawed({200, 0.65, 0.5}, 0.0);
  EXPECT_EQ(endOf(findPoses(rooms, task)), "found") << "outside the map";
  task.clearance_m = -1.0;
  EXPECT_EQ(endOf(findPoses(rooms, task)), "invalid");
}

/// Searches with at most 100,000 bricks. @return How often the search lets others change the map.
int countTurns(const CuboidMap& map, const PosePathTask& task, const std::string& end) {
  int num_turns = 0;
  Budget budget({INFINITY, 100000}, {[&num_turns] { ++num_turns; }, 0.0});
  EXPECT_EQ(endOf(findPosePath(map, task, kUnknownStops, budget)), end);
  return num_turns;
}

TEST(PoseTolerances, ASearchOfManyExitsOrGoalsTakesTurnsWithOthers) {
  CuboidMap rooms = roomsOfDecimetres(6);
  PosePathTask task = betweenTheRooms();
  task.start_map = test::yawed({1.73, 0.5, 0.5}, 0.2);
  task.start_tolerance_m = INFINITY;
  EXPECT_GT(countTurns(rooms, task, "spent"), 300) << "exits";

  const CellBox solid{{41, 0, 0}, {141, 100, 10}};
  rooms.replace(solid, {{solid, 1.0F}});
  task = betweenTheRooms();
  task.goal_map = test::yawed({9.0, 5.0, 0.5}, 0.0);
  task.goal_tolerance_m = 4.0;
  EXPECT_GT(countTurns(rooms, task, "goal"), 30) << "goals";
}

}  // namespace
}  // namespace cuboid_mapping
