// SPDX-License-Identifier: BSD-3-Clause
// Ways from starts that touch obstacles, and to goals that a robot cannot reach.
#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/query/corridor_query.h"
#include "cuboid_mapping/query/path_query.h"
#include "support/corridor_maze.h"
#include "support/dense_obstacles.h"
#include "support/way_end.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <queue>
#include <set>
#include <string>
#include <vector>

namespace cuboid_mapping {
namespace {

using test::DenseObstacles;
using test::endOf;
using test::kMazeArea;
using test::Random;

constexpr auto kStop = UnknownPolicy::kObstacle;

/// Two rooms of 10 x 8 x 4 with a wall between them at x = 10, with or without a door.
CuboidMap roomsOfMetres(bool has_door) {
  MapConfig config;
  config.resolution_m = 1.0;
  CuboidMap map(config);
  const CellBox wall{{10, 0, 0}, {11, 8, 4}};
  const CellBox door{{10, 0, 0}, {11, 4, 4}};
  map.replace(kAllCells, {{{{0, 0, 0}, {20, 8, 4}}, -1.0F}});
  map.replace(wall, {{wall, 1.0F}});
  if (has_door) map.replace(door, {{door, -1.0F}});
  return map;
}

/// A robot whose front is 0.2 m in the wall.
CorridorTask fromTheWall() {
  CorridorTask task;
  task.start_map = {8.7, 6, 2};
  task.goal_map = {17, 6, 2};
  task.size_m = {3, 3, 3};
  return task;
}

Answer<Corridor> findTolerantly(const CuboidMap& map, const CorridorTask& task,
                                UnknownPolicy policy = kStop) {
  return findCorridor(map, task, policy, Budget::unlimited());
}

TEST(WayTolerances, ARobotLeavesAWallThatItTouchesOnTheShortestWay) {
  const CuboidMap rooms = roomsOfMetres(true);
  CorridorTask task = fromTheWall();
  const auto blocked = findTolerantly(rooms, task);
  EXPECT_EQ(endOf(blocked), "start");
  ASSERT_TRUE(blocked.value.met);
  EXPECT_EQ(blocked.value.met->x, 10) << "the wall";
  task.start_tolerance_m = 0.1;
  EXPECT_EQ(endOf(findTolerantly(rooms, task)), "start");
  task.start_tolerance_m = 1.0;
  const auto left = findTolerantly(rooms, task);
  ASSERT_EQ(endOf(left), "found");
  EXPECT_NEAR(left->start_distance_m, 0.2, 1e-9);
  EXPECT_EQ(left->goal_distance_m, 0.0);
  EXPECT_EQ(left->path_map[0], task.start_map);
  EXPECT_LT((left->path_map[1] - Eigen::Vector3d(8.5, 6, 2)).norm(), 1e-9);
  EXPECT_EQ(left->path_map.back(), task.goal_map);
  EXPECT_NEAR(left->length_m, lengthOf(left->path_map), 1e-12);
  ASSERT_TRUE(left->met);
  EXPECT_EQ(left->met->x, 10);
  const std::vector<Eigen::Vector3d> rest(left->path_map.begin() + 1, left->path_map.end());
  EXPECT_TRUE(isPathFree(rooms, rest, task.size_m, kStop, Budget::unlimited()));
}

TEST(WayTolerances, ARobotDoesNotLeaveThroughAWall) {
  CorridorTask task = fromTheWall();
  for (const double tolerance_m : {10.0, 1e300, std::numeric_limits<double>::infinity()}) {
    task.start_tolerance_m = tolerance_m;
    Budget few(QueryLimits{1e3, 50'000});  // Places beyond the map are not looked for.
    EXPECT_EQ(endOf(findCorridor(roomsOfMetres(false), task, kStop, few)), "between");
  }
  task.start_map.x() = 9.9;  // More than half of the robot is beyond the wall's face.
  EXPECT_EQ(endOf(findTolerantly(roomsOfMetres(false), task)), "between");
  task.start_map.x() = 10.5;  // In the middle of the wall: there is no way out.
  EXPECT_EQ(endOf(findTolerantly(roomsOfMetres(false), task)), "start");
}

TEST(WayTolerances, ARobotLeavesUnknownSpaceThatItStandsIn) {
  CuboidMap rooms = roomsOfMetres(true);
  rooms.replace({{1, 1, 1}, {5, 7, 3}}, std::vector<UniformBox>());
  CorridorTask task = fromTheWall();
  task.start_map = {3, 6, 2};
  EXPECT_EQ(endOf(findTolerantly(rooms, task)), "start");
  task.start_tolerance_m = 5.0;
  const auto left = findTolerantly(rooms, task);
  ASSERT_EQ(endOf(left), "found");
  EXPECT_NEAR(left->start_distance_m, 3.5, 1e-9);
  ASSERT_TRUE(left->met);
  EXPECT_EQ(rooms.voxels().at(*left->met), Occupancy::kUnknown);
}

TEST(WayTolerances, APathEndsAtTheNearestReachablePlace) {
  CorridorTask task = fromTheWall();
  task.start_map = {5, 4, 2};
  task.goal_map = {9.4, 6, 2};
  const CuboidMap rooms = roomsOfMetres(false);
  const auto blocked = findTolerantly(rooms, task);
  EXPECT_EQ(endOf(blocked), "goal");
  ASSERT_TRUE(blocked.value.met);
  EXPECT_EQ(blocked.value.met->x, 10);
  task.goal_tolerance_m = 0.5;
  EXPECT_EQ(endOf(findTolerantly(rooms, task)), "goal") << "the wall is 0.9 m away";
  task.goal_tolerance_m = 1.0;
  const auto near = findTolerantly(rooms, task);
  ASSERT_EQ(endOf(near), "found");
  EXPECT_NEAR(near->goal_distance_m, 0.9, 1e-9);
  EXPECT_LT((near->path_map.back() - Eigen::Vector3d(8.5, 6, 2)).norm(), 1e-9);

  task.goal_map = {11.6, 6, 2};  // The nearest place is in the other room, which is closed.
  task.goal_tolerance_m = 3.0;
  EXPECT_EQ(endOf(findTolerantly(rooms, task)), "between");
  task.goal_tolerance_m = std::numeric_limits<double>::infinity();
  const auto far = findTolerantly(rooms, task);
  ASSERT_EQ(endOf(far), "found");
  EXPECT_NEAR(far->goal_distance_m, 3.1, 1e-9);
  task.goal_map = {17, 6, 2};  // Free, but out of reach.
  const auto closed = findTolerantly(rooms, task);
  ASSERT_EQ(endOf(closed), "found");
  EXPECT_NEAR(closed->goal_distance_m, 8.5, 1e-9);
  EXPECT_FALSE(closed->met);
  task.goal_map = {500, 6, 2};
  EXPECT_NEAR(findTolerantly(rooms, task)->goal_distance_m, 491.5, 1e-9) << "outside the map";
}

TEST(WayTolerances, APathDoesNotEndBeyondTheGrid) {
  MapConfig config;
  config.resolution_m = 1.0;
  CuboidMap map(config);
  constexpr std::int32_t kEnd = Grid::kMaxCell;
  const CellBox wall{{kEnd - 3, 0, 0}, {kEnd, 2, 1}};
  map.replace(wall, {{wall, 1.0F}});
  CorridorTask task;
  task.size_m = {1, 1, 1};
  task.start_map = {kEnd - 14.5, 0.5, 0.5};
  task.goal_map = {kEnd - 0.5, 0.5, 0.5};
  task.goal_tolerance_m = std::numeric_limits<double>::infinity();
  task.region = CellBox{{kEnd - 20, 0, 0}, {kEnd + 20, 3, 1}};
  const auto near = findTolerantly(map, task, UnknownPolicy::kFree);
  ASSERT_EQ(endOf(near), "found");
  EXPECT_NEAR(near->goal_distance_m, 2.0, 1e-6);
}

TEST(WayTolerances, AnAnswerNamesTheVoxelOfTheEndThatBlocks) {
  CorridorTask task = fromTheWall();
  task.start_tolerance_m = 1.0;
  task.goal_map = {21, 6, 2};
  const auto blocked = findTolerantly(roomsOfMetres(true), task);
  EXPECT_EQ(endOf(blocked), "goal");
  ASSERT_TRUE(blocked.value.met);
  EXPECT_GE(blocked.value.met->x, 20) << "not the wall at the start";
}

TEST(WayTolerances, ARobotMuchLargerThanTheMapIsBlockedAtOnce) {
  CorridorTask task;
  task.goal_map.x() = 100.0;
  task.size_m = {5000, 5000, 5000};
  QueryLimits limits;
  limits.max_bricks = 1000;
  Budget budget(limits);
  const auto blocked = findCorridor(roomsOfMetres(true), task, UnknownPolicy::kObstacle, budget);
  EXPECT_EQ(endOf(blocked), "start");
  ASSERT_TRUE(blocked.value.met);
  EXPECT_EQ(roomsOfMetres(true).voxels().at(*blocked.value.met), Occupancy::kOccupied);
}

TEST(WayTolerances, MustBeNumbersOfAtLeast0) {
  CorridorTask task = fromTheWall();
  task.start_tolerance_m = -1.0;
  EXPECT_EQ(endOf(findTolerantly(roomsOfMetres(true), task)), "invalid");
  task.start_tolerance_m = 0.0;
  task.goal_tolerance_m = std::nan("");
  EXPECT_EQ(endOf(findTolerantly(roomsOfMetres(true), task)), "invalid");
}

/// All places of a robot on the grid that are connected with some.
std::set<Cell> floodPlaces(DenseObstacles& obstacles, const Cell& size, const CellBox& from) {
  std::set<Cell> seen;
  std::queue<Cell> open;
  const auto reach = [&](const Cell& place) {
    const CellBox box{place, place + size};
    if (!kMazeArea.contains(box) || obstacles.isAny(box) || !seen.insert(place).second) return;
    open.push(place);
  };
  test::visitCells({from.min, from.max - size + Cell{1, 1, 1}}, reach);
  while (!open.empty()) {
    const Cell place = open.front();
    open.pop();
    for (int axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) {
        Cell next = place;
        next[axis] += step;
        reach(next);
      }
    }
  }
  return seen;
}

/// Centre of the robot at a place, as near to a point as it gets.
Eigen::Vector3d centerNear(const Cell& place, const Eigen::Vector3d& size_m, const Cell& size,
                           const Eigen::Vector3d& point) {
  const Eigen::Vector3d lower = toVector(place) + 0.5 * size_m;
  const Eigen::Vector3d upper = (toVector(place + size) - 0.5 * size_m).cwiseMax(lower);
  return point.cwiseMax(lower).cwiseMin(upper);
}

/// How far a robot must shrink on all sides to touch no occupied voxel, by bisection of samples.
double depthAt(const CuboidMap& map, const Eigen::Vector3d& center, const Eigen::Vector3d& size_m) {
  double least = 0.0;
  double most = 0.5 * size_m.minCoeff();
  const auto is_free = [&](double depth) {
    const Eigen::Vector3d core_m = size_m.array() - 2.0 * depth - 1e-7;
    return core_m.minCoeff() <= 0.0 ||
           !isAnyOccupied(map, *map.grid().toCellBox(boxAround(center, core_m)));
  };
  for (int i = 0; i < 40 && !is_free(least); ++i) {
    const double middle = 0.5 * (least + most);
    (is_free(middle) ? most : least) = middle;
  }
  return is_free(least) ? least : most;
}

/// Whether a robot enters nothing more deeply than at the start, by samples.
bool isWayOut(const CuboidMap& map, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
              const Eigen::Vector3d& size_m, double tolerance) {
  const double depth = depthAt(map, from, size_m) + tolerance;
  const Eigen::Vector3d core_m = size_m.array() - 2.0 * depth;
  if (core_m.minCoeff() <= 0.0) return false;
  for (int i = 0; i <= 200; ++i) {
    const Eigen::Vector3d center = from + i / 200.0 * (to - from);
    if (isAnyOccupied(map, *map.grid().toCellBox(boxAround(center, core_m)))) return false;
  }
  return true;
}

Eigen::Vector3d randomCenter(Random& random) {
  return {random.real(-18, 18), random.real(-18, 18), random.real(-4, 4)};
}

/// Distance of the nearest place of a set from which `is_good` says that it will do.
template <typename GoodT>
double nearestOf(const std::set<Cell>& places, const CorridorTask& task, const Cell& size,
                 const Eigen::Vector3d& point, double max_distance, const GoodT& is_good) {
  double least = std::numeric_limits<double>::infinity();
  for (const Cell& place : places) {
    const Eigen::Vector3d center = centerNear(place, task.size_m, size, point);
    const double distance = (center - point).norm();
    if (distance <= max_distance && distance < least && is_good(center)) least = distance;
  }
  return least;
}

TEST(WayTolerances, WaysOutAreTheShortestFromWhichTheGoalIsReached) {
  Random random(691);
  std::map<std::string, int> num_by_end;
  for (std::size_t m = 0; m < 60; ++m) {
    const test::ModelledMap maze = test::randomMaze(random);
    DenseObstacles obstacles(maze.voxels, kMazeArea, kStop);
    for (int i = 0; i < 60; ++i) {
      CorridorTask task;
      task.region = kMazeArea;
      for (int axis = 0; axis < 3; ++axis) task.size_m[axis] = random.real(1.0, 2.2);
      task.start_map = randomCenter(random);
      task.goal_map = randomCenter(random);
      const Grid& grid = maze.map.grid();
      const CellBox start = *grid.toCellBox(boxAround(task.start_map, task.size_m));
      const CellBox goal = *grid.toCellBox(boxAround(task.goal_map, task.size_m));
      if (!obstacles.isAny(start) || obstacles.isAny(goal)) continue;
      task.start_tolerance_m = random.real(0.2, 5.0);
      const auto answer = findTolerantly(maze.map, task);
      ++num_by_end[endOf(answer)];
      const Cell size = *grid.toSizeInCells(task.size_m);
      const std::set<Cell> places = floodPlaces(obstacles, size, goal);
      const double shortest = nearestOf(
          places, task, size, task.start_map, task.start_tolerance_m, [&](const auto& center) {
            return isWayOut(maze.map, task.start_map, center, task.size_m, 0.0);
          });
      const std::string note = test::seedNote(15 * m + static_cast<std::size_t>(i));
      if (!answer.isFound()) {
        ASSERT_EQ(shortest, std::numeric_limits<double>::infinity()) << note;
        continue;
      }
      EXPECT_LE(answer->start_distance_m, shortest + 1e-6) << note;
      EXPECT_LE(answer->start_distance_m, task.start_tolerance_m + 1e-9) << note;
      const Eigen::Vector3d exit = answer->path_map[1];
      EXPECT_TRUE(isWayOut(maze.map, task.start_map, exit, task.size_m, 1e-4)) << note;
      const CellBox covered = *grid.toCellBox(boxAround(exit, task.size_m));
      EXPECT_TRUE(answer->boxes.front().contains(covered)) << note;
      EXPECT_EQ(floodPlaces(obstacles, size, covered), places) << note;
      EXPECT_EQ(answer->path_map.back(), task.goal_map) << note;
    }
  }
  EXPECT_GT(num_by_end["found"], 100);
  EXPECT_GT(num_by_end["start"] + num_by_end["between"], 50);
}

TEST(WayTolerances, EndsAreTheNearestThatCanBeReached) {
  Random random(692);
  std::map<std::string, int> num_by_end;
  int num_near = 0;
  for (std::size_t m = 0; m < 60; ++m) {
    const test::ModelledMap maze = test::randomMaze(random);
    DenseObstacles obstacles(maze.voxels, kMazeArea, kStop);
    for (int i = 0; i < 15; ++i) {
      CorridorTask task;
      task.region = kMazeArea;
      for (int axis = 0; axis < 3; ++axis) task.size_m[axis] = random.real(1.2, 3.0);
      task.start_map = randomCenter(random);
      task.goal_map = randomCenter(random);
      const Grid& grid = maze.map.grid();
      const CellBox start = *grid.toCellBox(boxAround(task.start_map, task.size_m));
      if (obstacles.isAny(start)) continue;
      task.goal_tolerance_m = random.chance(0.3) ? INFINITY : random.real(0.2, 5.0);
      const auto answer = findTolerantly(maze.map, task);
      ++num_by_end[endOf(answer)];
      const Cell size = *grid.toSizeInCells(task.size_m);
      const double nearest =
          nearestOf(floodPlaces(obstacles, size, start), task, size, task.goal_map,
                    task.goal_tolerance_m, [](const auto&) { return true; });
      const std::string note = test::seedNote(15 * m + static_cast<std::size_t>(i));
      if (!answer.isFound()) {
        ASSERT_EQ(nearest, std::numeric_limits<double>::infinity()) << note;
        continue;
      }
      EXPECT_LE(answer->goal_distance_m, nearest + 1e-6) << note;
      EXPECT_LE(answer->goal_distance_m, task.goal_tolerance_m + 1e-9) << note;
      const Eigen::Vector3d end = answer->path_map.back();
      EXPECT_NEAR((end - task.goal_map).norm(), answer->goal_distance_m, 1e-12);
      EXPECT_TRUE(isPathFree(maze.map, answer->path_map, task.size_m, kStop, Budget::unlimited()))
          << note;
      num_near += answer->goal_distance_m > 0.0 ? 1 : 0;
    }
  }
  EXPECT_GT(num_near, 100);
  EXPECT_GT(num_by_end["goal"] + num_by_end["between"], 20);
}

TEST(WayTolerances, WaysOutHoldInTheMapAsItIsInTheEndWhenOthersChangeIt) {
  CuboidMap rooms = roomsOfMetres(true);
  rooms.replace({{0, 0, 0}, {7, 8, 4}}, std::vector<UniformBox>());
  CorridorTask task = fromTheWall();
  task.start_map = {2, 6, 2};
  task.start_tolerance_m = 7.0;
  const int num_changes = test::changeDuringSearch(
      rooms, {{5, 0, 0}, {6, 8, 4}},
      [&](const CuboidMap& map, Budget& budget) { return findCorridor(map, task, kStop, budget); });
  EXPECT_GE(num_changes, 2);
}

}  // namespace
}  // namespace cuboid_mapping
