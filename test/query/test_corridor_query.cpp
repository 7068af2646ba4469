// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/corridor_query.h"

#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/query/corridor_boxes.h"
#include "cuboid_mapping/query/path_query.h"
#include "cuboid_mapping/query/place_graph.h"
#include "support/corridor_maze.h"
#include "support/dense_obstacles.h"
#include "support/way_end.h"

#include <gtest/gtest.h>

#include <cmath>
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

Answer<Corridor> find(const CuboidMap& map, const CorridorTask& task,
                      UnknownPolicy policy = UnknownPolicy::kObstacle) {
  return findCorridor(map, task, policy, Budget::unlimited());
}

MapConfig oneMetre() {
  MapConfig config;
  config.resolution_m = 1.0;
  return config;
}

TEST(PullTight, goesStraightWherePortalsAllowIt) {
  CorridorPortals portals;
  for (const double x : {4.0, 8.0}) {
    portals.ranges_map.push_back({{x - 1.0, 0.0, 0.0}, {x + 1.0, 10.0, 2.0}});
    portals.centers_map.emplace_back(x, 5.0, 1.0);
  }
  const auto path = pullTight(portals, {0, 1, 1}, {12, 1, 1});
  ASSERT_EQ(path.size(), 4U);
  for (const Eigen::Vector3d& point : path) EXPECT_NEAR(point.y(), 1.0, 1e-3);
  portals.ranges_map[1].min_m.y() = 3.0;  // Around a corner.
  EXPECT_NEAR(pullTight(portals, {0, 1, 1}, {12, 1, 1})[2].y(), 3.0, 1e-3);
}

/// A room of 20 x 8 x 4 with a wall at x = 10 that has a door of full height, from y = 2 on.
CuboidMap roomWithDoor(std::int32_t door_width) {
  CuboidMap map(oneMetre());
  map.replace(kAllCells, {{{{0, 0, 0}, {10, 8, 4}}, -1.0F},
                          {{{11, 0, 0}, {20, 8, 4}}, -1.0F},
                          {{{10, 0, 0}, {11, 2, 4}}, 1.0F},
                          {{{10, 2, 0}, {11, 2 + door_width, 4}}, -1.0F},
                          {{{10, 2 + door_width, 0}, {11, 8, 4}}, 1.0F}});
  return map;
}

CorridorTask throughTheDoor() {
  CorridorTask task;
  task.start_map = {3, 4, 2};
  task.goal_map = {17, 4, 2};
  task.size_m = {3, 3, 3};
  return task;
}

TEST(CorridorQuery, goesThroughADoorOfTheRobotsWidthAndNotOneLess) {
  const auto answer = find(roomWithDoor(3), throughTheDoor());
  ASSERT_EQ(endOf(answer), "found");
  const Corridor& found = *answer;
  EXPECT_EQ(found.boxes,
            (std::vector<CellBox>{
                {{0, 0, 0}, {10, 8, 4}}, {{0, 2, 0}, {20, 5, 4}}, {{11, 0, 0}, {20, 8, 4}}}));
  EXPECT_EQ(endOf(find(roomWithDoor(2), throughTheDoor())), "between");
  CorridorTask slim = throughTheDoor();
  slim.size_m = {2, 2, 2};
  EXPECT_EQ(endOf(find(roomWithDoor(2), slim)), "found");
}

TEST(CorridorQuery, isOneBoxWhereNothingIsInBetween) {
  CorridorTask task = throughTheDoor();
  task.goal_map = {7.5, 4.5, 2.5};
  const Corridor found = *find(roomWithDoor(3), task);
  EXPECT_EQ(found.boxes, (std::vector<CellBox>{{{0, 0, 0}, {10, 8, 4}}}));
  EXPECT_TRUE(found.portals_map.empty());
  EXPECT_EQ(found.path_map, (std::vector<Eigen::Vector3d>{task.start_map, task.goal_map}));
  EXPECT_DOUBLE_EQ(found.length_m, (task.goal_map - task.start_map).norm());
}

TEST(CorridorQuery, saysWhyThereIsNone) {
  const CuboidMap map = roomWithDoor(3);
  CorridorTask task = throughTheDoor();
  task.start_map = {10, 1, 2};
  EXPECT_EQ(endOf(find(map, task)), "start");
  task = throughTheDoor();
  task.goal_map = {25, 4, 2};
  EXPECT_EQ(endOf(find(map, task)), "goal") << "unknown";
  EXPECT_EQ(endOf(find(map, task, UnknownPolicy::kFree)), "found");
  task = throughTheDoor();
  task.start_map.y() = 6.0;  // The straight way needs fewer.
  QueryLimits limits;
  limits.max_bricks = 20;
  Budget budget(limits);
  EXPECT_EQ(endOf(findCorridor(map, task, UnknownPolicy::kObstacle, budget)), "spent");
  EXPECT_EQ(budget.whyEnded(), BudgetLimit::kBricks);
  task.region = CellBox{{0, 0, 0}, {12, 8, 4}};
  EXPECT_EQ(endOf(find(map, task)), "goal") << "outside the region";
}

TEST(CorridorQuery, hasAShortPathInTheBoxesThatItsBudgetWasEnoughFor) {
  const CuboidMap map = roomWithDoor(3);
  CorridorTask task = throughTheDoor();
  task.start_map.y() = 6.0;
  const Corridor whole = *find(map, task);
  int num_cut = 0;
  QueryLimits limits;
  for (limits.max_bricks = 1;; ++limits.max_bricks) {
    Budget budget(limits);
    const auto answer = findCorridor(map, task, UnknownPolicy::kObstacle, budget);
    if (!budget.isSpent()) break;
    if (!answer.isFound() || answer->boxes != whole.boxes) continue;
    EXPECT_DOUBLE_EQ(answer->length_m, whole.length_m) << limits.max_bricks;
    ++num_cut;
  }
  EXPECT_GT(num_cut, 0);
}

TEST(CorridorQuery, growsThroughUnknownSpaceUpToAFarRegionAtOnce) {
  CorridorTask task = throughTheDoor();
  task.region = kAllCells;
  QueryLimits limits;
  limits.max_bricks = 20'000;
  Budget budget(limits);
  const auto found = findCorridor(roomWithDoor(3), task, UnknownPolicy::kFree, budget);
  ASSERT_EQ(endOf(found), "found");
  EXPECT_FALSE(budget.isSpent());
  const std::int32_t least = kAllCells.min.x;
  const std::int32_t last = kAllCells.max.x;
  EXPECT_EQ(found->boxes, (std::vector<CellBox>{{{least, least, least}, {10, last, last}},
                                                {{least, 2, least}, {last, 5, last}},
                                                {{11, least, least}, {last, last, last}}}));
}

TEST(CorridorQuery, keepsClearanceWhereThereIsRoom) {
  CorridorTask task = throughTheDoor();
  task.start_map.y() = task.goal_map.y() = 6.5;
  for (const int door_width : {3, 4, 5}) {
    SCOPED_TRACE(door_width);
    const CuboidMap map = roomWithDoor(door_width);
    task.clearance_m = 0.0;
    const std::vector<CellBox> boxes = find(map, task)->boxes;
    task.clearance_m = 1.0;
    const auto answer = find(map, task);
    ASSERT_EQ(endOf(answer), "found");
    EXPECT_EQ(answer->boxes, boxes);
    ASSERT_EQ(answer->path_map.size(), 4U);
    const std::vector<Eigen::Vector3d> door{answer->path_map[1], answer->path_map[2]};
    EXPECT_NEAR(door[0].y(), 2.0 + 0.5 * door_width, 1e-9) << "in the middle";
    EXPECT_NEAR(door[1].y(), 2.0 + 0.5 * door_width, 1e-9) << "in the middle";
    const double room = 0.5 * (door_width - 3) + 1e-9;
    const auto stop = UnknownPolicy::kObstacle;
    const Eigen::Vector3d size_m(3.0, 3.0 + 2.0 * room, 3.0);
    EXPECT_TRUE(
        isPathFree(map, door, size_m - Eigen::Vector3d::Constant(1e-6), stop, Budget::unlimited()));
  }
}

TEST(CorridorQuery, addsInflationOnAllSides) {
  CorridorTask task = throughTheDoor();
  task.size_m = {2, 2, 2};
  task.inflation_m = 0.5;
  EXPECT_EQ(find(roomWithDoor(3), task)->boxes, find(roomWithDoor(3), throughTheDoor())->boxes);
  EXPECT_EQ(endOf(find(roomWithDoor(2), task)), "between");
}

TEST(CorridorQuery, refusesWhatIsNoTask) {
  const CuboidMap map = roomWithDoor(3);
  const auto end_with = [&](auto change) {
    CorridorTask task = throughTheDoor();
    change(task);
    return endOf(find(map, task));
  };
  EXPECT_EQ(end_with([](auto& task) { task.size_m.x() = 0.0; }), "invalid");
  EXPECT_EQ(end_with([](auto& task) { task.size_m.y() = std::nan(""); }), "invalid");
  EXPECT_EQ(end_with([](auto& task) { task.start_map.z() = std::nan(""); }), "invalid");
  EXPECT_EQ(end_with([](auto& task) { task.goal_map.z() = 1e12; }), "invalid");
  EXPECT_EQ(end_with([](auto& task) { task.clearance_m = -0.1; }), "invalid");
  EXPECT_EQ(end_with([](auto& task) { task.inflation_m = std::nan(""); }), "invalid");
}

TEST(CorridorQuery, goesAroundAMapThroughUnknownSpace) {
  CuboidMap map(oneMetre());
  map.replace(kAllCells, {{{{0, -30, -30}, {1, 30, 30}}, 1.0F}});
  CorridorTask task;
  task.start_map = {-5, 0, 0};
  task.goal_map = {6, 0, 0};
  task.size_m = {2, 2, 2};
  EXPECT_EQ(endOf(find(map, task)), "start");
  EXPECT_EQ(endOf(find(map, task, UnknownPolicy::kFree)), "found");
  task.region = CellBox{{-10, -30, -30}, {10, 30, 30}};
  EXPECT_EQ(endOf(find(map, task, UnknownPolicy::kFree)), "between");
}

/// A wall as a planar laser sees it: one layer of voxels, with a gap 20 m from the straight way.
TEST(CorridorQuery, goesAroundAWallOfOneLayerThroughUnknownSpaceNotOverIt) {
  CuboidMap map(oneMetre());
  map.replace(kAllCells, {{{{0, -20, 1}, {1, 20, 2}}, 1.0F}});
  CorridorTask task;
  task.start_map = {-5, 0, 1.5};
  task.goal_map = {6, 0, 1.5};
  task.size_m = {3, 3, 3};
  const auto around = find(map, task, UnknownPolicy::kFree);
  ASSERT_EQ(endOf(around), "found");
  EXPECT_GT(around->length_m, 40.0);
  for (const CellBox& box : around->boxes) {
    EXPECT_EQ(box.min.z, 0);
    EXPECT_EQ(box.max.z, 3);
  }
  task.goal_map.z() = 4.5;  // Between the heights, over it.
  const auto over = find(map, task, UnknownPolicy::kFree);
  ASSERT_EQ(endOf(over), "found");
  EXPECT_LT(over->length_m, 20.0);
}

/// Two paths from (0, 4) to (60, 4), both 4 m wide: six lanes of 42 m, up and down near the goal; and
/// a detour, which first leads away from it and is shorter.
CuboidMap twoWays() {
  CuboidMap map(oneMetre());
  const auto open = [&map](const CellBox& box) { map.replace(box, {{{box, -1.0F}}}); };
  open({{-50, 2, 0}, {16, 6, 4}});
  for (std::int32_t lane = 0; lane < 6; ++lane) {
    const std::int32_t x = 16 + 8 * lane;
    open({{x, 2, 0}, {x + 4, 44, 4}});
    const std::int32_t turn_y = lane % 2 == 0 ? 40 : 2;
    open({{x, turn_y, 0}, {x + 12, turn_y + 4, 4}});
  }
  open({{56, 2, 0}, {64, 6, 4}});
  open({{-50, -20, 0}, {-46, 6, 4}});
  open({{-50, -20, 0}, {64, -16, 4}});
  open({{60, -20, 0}, {64, 6, 4}});
  return map;
}

TEST(CorridorQuery, takesTheWayThatIsShorterInMetres) {
  const CuboidMap map = twoWays();
  CorridorTask task;
  task.start_map = {2, 4, 2};
  task.goal_map = {62, 4, 2};
  task.size_m = {2, 2, 2};
  const auto shorter = find(map, task);
  ASSERT_EQ(endOf(shorter), "found");
  task.region = CellBox{{-8, -8, 0}, {64, 48, 4}};
  const auto lanes = find(map, task);
  ASSERT_EQ(endOf(lanes), "found");
  EXPECT_GT(lanes->length_m, 250.0);
  EXPECT_LT(shorter->length_m, 230.0);
}

/// Pillars, but for a lane around a straight line.
CuboidMap pillars(const Eigen::Vector3d& from, const Eigen::Vector3d& to, Random& random) {
  CuboidMap map(oneMetre());
  const CellBox area{{0, 0, 0}, {64, 64, 3}};
  map.replace(area, {{{area, -1.0F}}});
  const Eigen::Vector3d along = (to - from).normalized();
  for (int i = 0; i < 400; ++i) {
    const Cell at{random.integer(0, 63), random.integer(0, 63), 0};
    const Eigen::Vector3d beside = toVector(at) + Eigen::Vector3d(0.5, 0.5, from.z()) - from;
    if (beside.cross(along).norm() < 3.0) continue;
    const CellBox pillar{at, at + Cell{1, 1, 3}};
    map.replace(pillar, {{{pillar, 1.0F}}});
  }
  return map;
}

TEST(CorridorQuery, goesStraightWhereTheRobotFits) {
  CorridorTask task;
  task.size_m = {1, 1, 1};
  Random random(7);
  for (int i = 0; i < 20; ++i) {
    task.start_map = {random.integer(1, 62) + 0.5, 1.5, 1.5};
    task.goal_map = {random.integer(1, 62) + 0.5, 62.5, 1.5};
    const auto way = find(pillars(task.start_map, task.goal_map, random), task);
    ASSERT_EQ(endOf(way), "found");
    EXPECT_LT(way->length_m, 1.01 * (task.goal_map - task.start_map).norm()) << i;
  }
}

/// The detour is closed while a search lets others change the map, each time at another moment.
TEST(CorridorQuery, holdsInTheMapAsItIsInTheEndWhenOthersChangeIt) {
  CorridorTask task;
  task.start_map = {2, 4, 2};
  task.goal_map = {62, 4, 2};
  task.size_m = {2, 2, 2};
  int num_changed = 0;
  for (int change_at = 1;; ++change_at) {
    CuboidMap map = twoWays();
    int num_turns = 0;
    MapUnlock turns;
    turns.period_s = 0.0;
    turns.yield = [&] {
      const CellBox wall{{0, -20, 0}, {1, -16, 4}};
      if (++num_turns == change_at) map.replace(wall, {{wall, 1.0F}});
    };
    Budget budget(QueryLimits{}, turns);
    const auto corridor = findCorridor(map, task, UnknownPolicy::kObstacle, budget);
    ASSERT_EQ(endOf(corridor), "found") << change_at;
    for (const CellBox& box : corridor->boxes) {
      ASSERT_FALSE(isAnyOccupied(map, box)) << box << " after a change at turn " << change_at;
    }
    if (num_turns < change_at) break;
    ++num_changed;
    EXPECT_GT(corridor->length_m, 250.0) << "through the lanes";
  }
  EXPECT_GT(num_changed, 5);
}

/// Whether a path of places exists, each beside the previous one.
bool isConnected(DenseObstacles& obstacles, const Cell& size, const CellBox& start,
                 const CellBox& goal, const CellBox& region) {
  std::set<Cell> seen;
  std::queue<Cell> open;
  const auto reach = [&](const Cell& place) {
    const CellBox box{place, place + size};
    if (!region.contains(box) || obstacles.isAny(box) || !seen.insert(place).second) return;
    open.push(place);
  };
  reach(start.min);
  while (!open.empty()) {
    const Cell place = open.front();
    open.pop();
    if (goal.contains(CellBox{place, place + size})) return true;
    for (int axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) {
        Cell next = place;
        next[axis] += step;
        reach(next);
      }
    }
  }
  return false;
}

testing::AssertionResult isCorridor(const Corridor& corridor, const CorridorTask& task,
                                    DenseObstacles& obstacles, const Grid& grid) {
  const Cell size = *grid.toSizeInCells(task.size_m);
  const auto fail = [] { return testing::AssertionFailure(); };
  const std::vector<CellBox>& boxes = corridor.boxes;
  if (boxes.empty()) return fail() << "no box";
  for (const CellBox& box : boxes) {
    if (obstacles.isAny(box)) return fail() << box << " has an obstacle";
  }
  if (corridor.portals_map.size() + 1 != boxes.size()) return fail() << "portals";
  if (corridor.path_map.size() != boxes.size() + 1) return fail() << "points";
  if (corridor.path_map.front() != task.start_map || corridor.path_map.back() != task.goal_map) {
    return fail() << "does not go from start to goal";
  }
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    for (const Eigen::Vector3d& point : {corridor.path_map[i], corridor.path_map[i + 1]}) {
      if (!boxes[i].contains(*grid.toCellBox(boxAround(point, task.size_m)))) {
        return fail() << point.transpose() << " is not in " << i;
      }
    }
    if (i == 0) continue;
    const CellBox common = intersect(boxes[i - 1], boxes[i]);
    for (int axis = 0; axis < 3; ++axis) {
      if (common.max[axis] - common.min[axis] < size[axis]) return fail() << "overlap";
    }
    if (corridor.portals_map[i - 1] != grid.centerOf(common)) return fail() << "portal";
  }
  return testing::AssertionSuccess();
}

Eigen::Vector3d randomPose(Random& random) {
  Eigen::Vector3d pose(random.real(-19, 19), random.real(-19, 19), random.real(-5, 5));
  if (random.chance(0.3)) pose = pose.array().round();
  return pose;
}

TEST(CorridorQuery, findsOneIfAndOnlyIfThereIsAWayFromVoxelToVoxel) {
  Random random(102);
  constexpr std::size_t kMazes = 200;
  std::map<std::string, std::size_t> num_by_end;
  std::size_t num_long = 0;
  for (std::size_t m = 0; m < kMazes; ++m) {
    const test::ModelledMap maze = test::randomMaze(random);
    CorridorTask task;
    const UnknownPolicy policy =
        random.chance(0.7) ? UnknownPolicy::kObstacle : UnknownPolicy::kFree;
    task.region = kMazeArea;
    DenseObstacles obstacles(maze.voxels, kMazeArea, policy);
    for (int i = 0; i < 40; ++i) {
      for (int axis = 0; axis < 3; ++axis) task.size_m[axis] = random.real(0.6, 4.0);
      if (i % 2 == 0) task.size_m = Eigen::Vector3d::Constant(random.integer(1, 4));
      task.start_map = randomPose(random);
      task.goal_map = randomPose(random);
      task.clearance_m = i % 3 == 0 ? 0.0 : random.real(0.0, 3.0);
      const Grid& grid = maze.map.grid();
      const auto corridor = find(maze.map, task, policy);
      const std::string end = endOf(corridor);
      ++num_by_end[end];
      const CellBox start = *grid.toCellBox(boxAround(task.start_map, task.size_m));
      const CellBox goal = *grid.toCellBox(boxAround(task.goal_map, task.size_m));
      const auto is_blocked = [&](const CellBox& box) {
        return !kMazeArea.contains(box) || obstacles.isAny(box);
      };
      ASSERT_EQ(end == "start", is_blocked(start));
      if (is_blocked(start)) continue;
      ASSERT_EQ(end == "goal", is_blocked(goal));
      if (is_blocked(goal)) continue;
      const Cell size = *grid.toSizeInCells(task.size_m);
      ASSERT_EQ(end == "found", isConnected(obstacles, size, start, goal, kMazeArea))
          << test::seedNote(40 * m + static_cast<std::size_t>(i));
      if (end != "found") continue;
      ASSERT_TRUE(isCorridor(*corridor, task, obstacles, grid))
          << test::seedNote(40 * m + static_cast<std::size_t>(i));
      num_long += corridor->boxes.size() > 3 ? 1 : 0;
    }
  }
  EXPECT_GT(num_by_end["found"], 200U);
  EXPECT_GT(num_by_end["between"], 100U);
  EXPECT_GT(num_by_end["start"], 100U);
  EXPECT_GT(num_long, 40U);
}

}  // namespace
}  // namespace cuboid_mapping
