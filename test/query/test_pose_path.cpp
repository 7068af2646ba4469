// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/pose_path.h"

#include "support/bodies.h"
#include "support/flat_robot.h"
#include "support/voxel_map.h"
#include "support/way_end.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <queue>
#include <string>

namespace cuboid_mapping {
namespace {

using test::boxBody;
using test::endOf;
using test::FlatRobot;
using test::Random;
using test::yawed;

MapConfig decimetres() {
  MapConfig config;
  config.resolution_m = 0.1;
  return config;
}

/// Two rooms of 2 x 2 x 1 m, with a wall between them at x = 2 m that has a door from y = 1 on.
CuboidMap twoRooms(double door_m) {
  CuboidMap map(decimetres());
  const std::int32_t end = 10 + static_cast<std::int32_t>(std::lround(10.0 * door_m));
  map.replace(kAllCells, {{{{0, 0, 0}, {20, 20, 10}}, -1.0F},
                          {{{20, 0, 0}, {21, 10, 10}}, 1.0F},
                          {{{20, 10, 0}, {21, end, 10}}, -1.0F},
                          {{{20, end, 0}, {21, 20, 10}}, 1.0F},
                          {{{21, 0, 0}, {41, 20, 10}}, -1.0F}});
  return map;
}

/// A base of 1.0 x 0.6 m that stands across, in both rooms.
PosePathTask acrossTheRooms() {
  PosePathTask task;
  task.body = boxBody({1.0, 0.6, 0.3});
  task.start_map = yawed({0.8, 0.7, 0.5}, M_PI / 2);
  task.goal_map = yawed({3.3, 0.7, 0.5}, M_PI / 2);
  return task;
}

Answer<PosePath> find(const CuboidMap& map, const PosePathTask& task,
                      UnknownPolicy policy = UnknownPolicy::kObstacle) {
  return findPosePath(map, task, policy, Budget::unlimited());
}

void expectPath(const CuboidMap& map, const PosePathTask& task, const Answer<PosePath>& answer,
                UnknownPolicy policy = UnknownPolicy::kObstacle) {
  ASSERT_EQ(endOf(answer), "found");
  const PosePath& path = *answer;
  ASSERT_GE(path.T_map_body.size(), 2U);
  EXPECT_TRUE(path.T_map_body.front().isApprox(task.start_map));
  EXPECT_TRUE(path.T_map_body.back().isApprox(task.goal_map));
  EXPECT_TRUE(
      checkMotion(map, task.body, path.T_map_body, policy, Budget::unlimited()).isNotFound());
  EXPECT_EQ(lengthOf(path.T_map_body), path.length_m);
}

TEST(PosePath, TurnsABaseThroughADoorThatIsNarrowerThanItsLength) {
  const CuboidMap rooms = twoRooms(0.8);
  const PosePathTask task = acrossTheRooms();
  const auto path = find(rooms, task);
  expectPath(rooms, task, path);
  EXPECT_LT(path->length_m, 4.0);
  EXPECT_LT(path->T_map_body.size(), 16U) << "steps are joined";
  EXPECT_GT(path->num_poses, 10U);
  // The box that encloses all headings does not pass, and the base not where the door is narrower.
  CorridorTask corridor;
  corridor.start_map = task.start_map.translation();
  corridor.goal_map = task.goal_map.translation();
  corridor.size_m = {1.17, 1.17, 0.3};
  EXPECT_EQ(endOf(findCorridor(rooms, corridor, UnknownPolicy::kObstacle, Budget::unlimited())),
            "between");
  EXPECT_EQ(endOf(find(twoRooms(0.5), task)), "between");
}

TEST(PosePath, GoesStraightWhereNothingIsInTheWay) {
  const CuboidMap rooms = twoRooms(0.8);
  PosePathTask task = acrossTheRooms();
  task.goal_map = yawed({0.9, 1.3, 0.52}, 1.0);
  const auto path = find(rooms, task);
  expectPath(rooms, task, path);
  EXPECT_EQ(path->T_map_body.size(), 2U);
}

TEST(PosePath, TakesTheShorterWayAroundAWall) {
  // The way below the wall is longer, and nearer to the origin of the map.
  CuboidMap map(decimetres());
  map.replace(kAllCells, {{{{0, 0, 0}, {41, 60, 10}}, -1.0F}});
  map.replace({{20, 8, 0}, {21, 50, 10}}, {{{{20, 8, 0}, {21, 50, 10}}, 1.0F}});
  PosePathTask task;
  task.body = boxBody({0.3, 0.3, 0.3});
  task.start_map = yawed({1.0, 3.0, 0.5}, 0.0);
  task.goal_map = yawed({3.0, 3.0, 0.5}, 0.0);
  const auto path = find(map, task);
  expectPath(map, task, path);
  for (const Eigen::Isometry3d& T_map_body : path->T_map_body)
    EXPECT_GE(T_map_body.translation().y(), 2.9);
}

TEST(PosePath, SaysWhyThereIsNone) {
  const CuboidMap rooms = twoRooms(0.8);
  const auto end_with = [&](auto change) {
    PosePathTask task = acrossTheRooms();
    change(task);
    return endOf(find(rooms, task));
  };
  EXPECT_EQ(end_with([](auto& t) { t.start_map = yawed({1.8, 0.7, 0.5}, 0.0); }), "start");
  EXPECT_EQ(end_with([](auto& t) { t.goal_map = yawed({3.9, 0.7, 0.5}, 0.0); }), "goal");
  EXPECT_EQ(end_with([](auto& t) { t.region = CellBox{{0, 0, 0}, {30, 20, 10}}; }), "goal");
  EXPECT_EQ(end_with([](auto& t) { t.region = CellBox{{0, 0, 0}, {41, 15, 10}}; }), "between");
  QueryLimits limits;
  limits.max_bricks = 500;
  Budget budget(limits);
  EXPECT_EQ(endOf(findPosePath(rooms, acrossTheRooms(), UnknownPolicy::kObstacle, budget)),
            "spent");
  EXPECT_EQ(budget.whyEnded(), BudgetLimit::kBricks);
  limits = {};
  limits.max_entries = 2;
  Budget few(limits);
  EXPECT_EQ(endOf(findPosePath(rooms, acrossTheRooms(), UnknownPolicy::kObstacle, few)), "spent");
}

TEST(PosePath, SaysWhatIsWrongWithATask) {
  const CuboidMap rooms = twoRooms(0.8);
  const auto expect_fault = [&](const std::string& part, auto change) {
    PosePathTask task = acrossTheRooms();
    change(task);
    const std::string text = findFault(task, rooms.grid());
    EXPECT_NE(text.find(part), std::string::npos) << "says: " << text;
    EXPECT_EQ(endOf(find(rooms, task)), "invalid");
  };
  expect_fault("no part", [](auto& t) { t.body = {}; });
  expect_fault("in metres", [](auto& t) { t.body = boxBody({1000, 600, 300}); });
  expect_fault("start must be finite", [](auto& t) { t.start_map.translation().x() = NAN; });
  expect_fault("goal must be finite", [](auto& t) { t.goal_map.linear() *= 1.1; });
  expect_fault("goal tilts", [](auto& t) {
    t.goal_map.rotate(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX()));
  });
  expect_fault("goal is a voxel or more above",
               [](auto& t) { t.goal_map.translation().z() = 0.7; });
  PosePathTask climber = acrossTheRooms();
  climber.goal_map.translation().z() = 0.7;
  climber.may_climb = true;
  EXPECT_EQ(endOf(find(rooms, climber)), "found");
}

TEST(PosePath, ChecksThePathAgainWhenTheMapHasChangedMeanwhile) {
  CuboidMap rooms = twoRooms(0.8);
  const PosePathTask task = acrossTheRooms();
  int num_turns = 0;
  MapUnlock turns;
  turns.period_s = 0.0;
  turns.yield = [&] {
    // The door closes in the middle of the first search; what it has seen by then does not count.
    if (++num_turns == 100)
      rooms.replace({{20, 10, 0}, {21, 18, 10}}, {{{{20, 10, 0}, {21, 18, 10}}, 1.0F}});
  };
  Budget budget(QueryLimits{}, turns);
  const auto path = findPosePath(rooms, task, UnknownPolicy::kObstacle, budget);
  EXPECT_GT(num_turns, 100);
  EXPECT_EQ(endOf(path), "between");
}

constexpr CellBox kFlatArea{{0, 0, 0}, {24, 24, 5}};
constexpr int kNumHeadings = 16;

/// Walls with doors of about the robot's width, and clutter.
CuboidMap randomFlat(Random& random) {
  MapConfig config;
  config.resolution_m = 1.0;
  CuboidMap map(config);
  const auto fill = [&](const CellBox& asked, std::optional<float> log_odds) {
    const CellBox box = intersect(asked, kFlatArea);
    if (box.isEmpty()) return;
    std::vector<UniformBox> boxes;
    if (log_odds) boxes.push_back({box, *log_odds});
    map.replace(box, boxes);
  };
  fill(kFlatArea, -1.0F);
  for (int axis = 0; axis < 2; ++axis) {
    CellBox wall = kFlatArea;
    wall.min[axis] = random.integer(8, 15);
    wall.max[axis] = wall.min[axis] + random.integer(1, 2);
    fill(wall, 1.0F);
    for (int door = random.integer(1, 2); door > 0; --door) {
      CellBox open = wall;
      open.min[1 - axis] = random.integer(0, 20);
      open.max[1 - axis] = open.min[1 - axis] + random.integer(2, 5);
      fill(open, -1.0F);
    }
  }
  for (int i = random.integer(0, 8); i > 0; --i) {
    const Cell min = test::randomCell(random, kFlatArea);
    fill({min, min + Cell{random.integer(1, 3), random.integer(1, 3), random.integer(1, 5)}},
         random.chance(0.3) ? std::nullopt : std::optional<float>(1.0F));
  }
  return map;
}

/// A breadth-first search over all places and headings, with nothing but voxels that overlap.
class NaiveSearch {
 public:
  NaiveSearch(const CuboidMap& map, const FlatRobot& robot, UnknownPolicy policy, double z)
      : map_(map), robot_(robot), policy_(policy), z_(z) {}

  bool isConnected(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    if (isFree(robot_.sweep(from, to))) return true;
    std::array<bool, 24 * 24 * kNumHeadings> seen{};
    std::queue<Cell> open;
    const auto reach = [&](const Cell& node, const FlatRobot::Columns& sweep, const Cell& by) {
      if (node.x < 0 || node.y < 0 || node.x >= 24 || node.y >= 24) return;
      bool& is_seen = seen[static_cast<std::size_t>((node.z * 24 + node.y) * 24 + node.x)];
      if (is_seen || !isFree(sweep, by)) return;
      is_seen = true;
      open.push(node);
    };
    for (const Cell& node : findAround(from)) reach(node, robot_.sweep(from, poseOf(node)), {});
    const std::vector<Cell> last = findAround(to);
    while (!open.empty()) {
      const Cell node = open.front();
      open.pop();
      const bool is_last = std::find(last.begin(), last.end(), node) != last.end();
      if (is_last && isFree(robot_.sweep(poseOf(node), to))) return true;
      for (const Cell& step : FlatRobot::kSteps) {
        const Cell next{node.x + step.x, node.y + step.y,
                        (node.z + step.z + kNumHeadings) % kNumHeadings};
        reach(next, robot_.step(node.z, step), node);
      }
    }
    return false;
  }
  bool isFree(const FlatRobot::Columns& columns, const Cell& by = {}) {
    for (const auto& [x, y] : columns) {
      for (auto z = static_cast<std::int32_t>(std::floor(z_ + robot_.low() + 1e-6));
           z < z_ + robot_.high() - 1e-6; ++z) {
        const Cell voxel{x + by.x, y + by.y, z};
        const Occupancy occupancy = map_.voxels().at(voxel);
        if (!kFlatArea.contains(voxel) || occupancy == Occupancy::kOccupied) return false;
        if (occupancy == Occupancy::kUnknown && policy_ == UnknownPolicy::kObstacle) return false;
      }
    }
    return true;
  }

 private:
  /// x, y, and heading in place of z.
  static Eigen::Vector3d poseOf(const Cell& node) {
    return {node.x + 0.5, node.y + 0.5, 2.0 * M_PI / kNumHeadings * node.z};
  }
  static std::vector<Cell> findAround(const Eigen::Vector3d& pose) {
    std::vector<Cell> around;
    test::visitCells({{0, 0, 0}, {24, 24, kNumHeadings}}, [&](const Cell& node) {
      const Eigen::Vector3d away = poseOf(node) - pose;
      const double turn = std::abs(std::remainder(away.z(), 2.0 * M_PI));
      if (std::abs(away.x()) < 1.0 && std::abs(away.y()) < 1.0 &&
          turn < 2.0 * M_PI / kNumHeadings) {
        around.push_back(node);
      }
    });
    return around;
  }

  const CuboidMap& map_;
  const FlatRobot& robot_;
  UnknownPolicy policy_;
  double z_;
};

TEST(PosePath, IsFoundIfAndOnlyIfThePlacesAndHeadingsAreConnected) {
  Random random(3960);
  std::map<std::string, int> num_by_end;
  int num_between = 0;
  int num_turned = 0;
  for (int r = 0; r < 8; ++r) {
    FlatRobot::Shape shape;
    shape.half = {random.real(1.0, 2.6), random.real(0.4, 1.4)};
    if (random.chance(0.5)) shape.offset = {random.real(-1.0, 1.0), random.real(-0.3, 0.3)};
    shape.low = random.real(-1.0, -0.2);
    shape.high = random.real(0.2, 1.0);
    const FlatRobot robot(shape, 0.0);
    const FlatRobot large(shape, FlatRobot::kSureMargin);
    for (int m = 0; m < 30; ++m) {
      const CuboidMap map = randomFlat(random);
      PosePathTask task;
      task.body = robot.body();
      const UnknownPolicy policy =
          random.chance(0.7) ? UnknownPolicy::kObstacle : UnknownPolicy::kFree;
      task.region = kFlatArea;
      const double z = random.real(1.0, 4.0);
      NaiveSearch naive(map, robot, policy, z);
      NaiveSearch wide(map, large, policy, z);
      for (int i = 0; i < 4; ++i) {
        const Eigen::Vector3d start(random.real(1, 23), random.real(1, 23), random.real(-3, 3));
        const Eigen::Vector3d goal(random.real(1, 23), random.real(1, 23), random.real(-3, 3));
        task.start_map = yawed({start.x(), start.y(), z}, start.z());
        task.goal_map = yawed({goal.x(), goal.y(), z}, goal.z());
        const auto path = find(map, task, policy);
        const std::string end = endOf(path);
        ++num_by_end[end];
        const bool is_start_free = naive.isFree(robot.sweep(start, start));
        ASSERT_EQ(end == "start", !is_start_free) << test::seedNote(r);
        if (!is_start_free) continue;
        const bool is_goal_free = naive.isFree(robot.sweep(goal, goal));
        ASSERT_EQ(end == "goal", !is_goal_free);
        if (!is_goal_free) continue;
        const bool is_found = end == "found";
        const bool may_be = naive.isConnected(start, goal);
        const bool must_be = wide.isConnected(start, goal);
        ASSERT_LE(must_be, may_be);
        ASSERT_LE(is_found, may_be) << "robot " << r << ", map " << m << ", task " << i;
        ASSERT_LE(must_be, is_found) << "robot " << r << ", map " << m << ", task " << i;
        num_between += must_be == may_be ? 0 : 1;
        if (!is_found) continue;
        expectPath(map, task, path, policy);
        num_turned += path->T_map_body.size() > 3 ? 1 : 0;
      }
    }
  }
  std::cout << "ends:";
  for (const auto& [end, num] : num_by_end) std::cout << ' ' << end << ' ' << num;
  std::cout << ", within the tolerance: " << num_between << '\n';
  EXPECT_GT(num_by_end["found"], 100);
  EXPECT_GT(num_by_end["between"], 50);
  EXPECT_GT(num_turned, 50);
  EXPECT_LT(num_between, 40);
}

}  // namespace
}  // namespace cuboid_mapping
