// SPDX-License-Identifier: BSD-3-Clause
// Questions of planners about maps of real scans, checked voxel by voxel.
#include "cuboid_mapping/query/corridor_query.h"
#include "cuboid_mapping/query/fit_query.h"
#include "cuboid_mapping/query/path_query.h"
#include "support/real_scene.h"

#include <gtest/gtest.h>

#include <vector>

namespace cuboid_mapping {
namespace {

using test::DenseObstacles;
using test::makeObstacles;
using test::Random;
using test::readScene;

/// Places of a box, numbered by connected sets.
class ConnectedPlaces {
 public:
  ConnectedPlaces(DenseObstacles& obstacles, const CellBox& area, const Cell& size)
      : places_{area.min, area.max - size + Cell{1, 1, 1}} {
    numbers_.assign(static_cast<std::size_t>(places_.numVoxels()), kBlocked);
    test::visitCells(places_, [&](const Cell& cell) {
      if (!obstacles.isAny({cell, cell + size})) numbers_[indexOf(cell)] = kFree;
    });
    int number = 0;
    test::visitCells(places_, [&](const Cell& cell) {
      if (numbers_[indexOf(cell)] == kFree) flood(cell, ++number);
    });
  }

  [[nodiscard]] int numberAt(const Cell& place) const { return numbers_[indexOf(place)]; }

 private:
  static constexpr int kBlocked = 0;
  static constexpr int kFree = -1;

  [[nodiscard]] std::size_t indexOf(const Cell& cell) const {
    const Cell at = cell - places_.min;
    const Cell size = places_.size();
    return (static_cast<std::size_t>(at.z) * static_cast<std::size_t>(size.y) +
            static_cast<std::size_t>(at.y)) *
               static_cast<std::size_t>(size.x) +
           static_cast<std::size_t>(at.x);
  }

  void flood(const Cell& from, int number) {
    std::vector<Cell> open{from};
    numbers_[indexOf(from)] = number;
    while (!open.empty()) {
      const Cell cell = open.back();
      open.pop_back();
      for (int direction = 0; direction < 6; ++direction) {
        Cell next = cell;
        next[direction / 2] += direction % 2 == 0 ? 1 : -1;
        if (!places_.contains(next) || numbers_[indexOf(next)] != kFree) continue;
        numbers_[indexOf(next)] = number;
        open.push_back(next);
      }
    }
  }

  CellBox places_;
  std::vector<int> numbers_;
};

TEST(RealScans, haveACorridorIfAndOnlyIfThereIsAWayFromVoxelToVoxel) {
  const auto scene = readScene("sim_fr079", 0.1);
  if (!scene) GTEST_SKIP() << "CUBOID_DATA_DIR is not set: no real scans to test with";
  Random random(131);
  const Grid& grid = scene->map.grid();
  const CellBox area = *scene->map.bounds();
  std::size_t num_found = 0;
  std::size_t num_none = 0;
  for (const UnknownPolicy policy : {UnknownPolicy::kObstacle, UnknownPolicy::kFree}) {
    DenseObstacles obstacles = makeObstacles(scene->map, area, policy);
    for (const double robot_m : {0.2, 0.5, 0.8}) {
      CorridorTask task;
      task.size_m = Eigen::Vector3d::Constant(robot_m);
      task.region = area;
      const Cell size = *grid.toSizeInCells(task.size_m);
      const ConnectedPlaces connected(obstacles, area, size);
      const auto random_pose = [&] {
        const Eigen::Vector3d pose = scene->poses_map[random.index(scene->poses_map.size())];
        const Eigen::Vector3d near = pose + 0.5 * test::randomPoint(random, 1.0);
        return findNearestFit(scene->map, near, task.size_m, policy, 2.0, Budget::unlimited())
            .valueOr({near, 0.0})
            .center_map;
      };
      for (int i = 0; i < 40; ++i) {
        task.start_map = random_pose();
        task.goal_map = random_pose();
        const auto corridor = findCorridor(scene->map, task, policy, Budget::unlimited());
        if (!corridor.isFound() && corridor.value.blocked != Blocked::kBetween) continue;
        const Cell start = grid.toCellBox(boxAround(task.start_map, task.size_m))->min;
        const Cell goal = grid.toCellBox(boxAround(task.goal_map, task.size_m))->min;
        const bool is_connected = connected.numberAt(start) == connected.numberAt(goal);
        ASSERT_EQ(corridor.isFound(), is_connected)
            << robot_m << " m " << test::seedNote(static_cast<std::size_t>(i));
        for (const CellBox& box : corridor.value.boxes) ASSERT_FALSE(obstacles.isAny(box)) << box;
        ++(is_connected ? num_found : num_none);
      }
    }
  }
  std::cout << num_found << " corridors, " << num_none << " times none" << std::endl;
  EXPECT_GT(num_found, 40U);
}

TEST(RealScans, areAnsweredForAsALookAtEveryVoxelTells) {
  const auto scene = readScene("kitti_0005_city", 0.2);
  if (!scene) GTEST_SKIP() << "CUBOID_DATA_DIR is not set: no real scans to test with";
  Random random(132);
  const CellBox area = *scene->map.bounds();
  std::size_t num_blocked = 0;
  std::size_t num_placed = 0;
  constexpr std::size_t kCases = 5000;
  for (const UnknownPolicy policy : {UnknownPolicy::kObstacle, UnknownPolicy::kFree}) {
    DenseObstacles obstacles = makeObstacles(scene->map, area, policy);
    const Grid& grid = scene->map.grid();
    for (std::size_t i = 0; i < kCases; ++i) {
      const Eigen::Vector3d from = scene->poses_map[random.index(scene->poses_map.size())] +
                                   10.0 * test::randomPoint(random, 1.0);
      Eigen::Vector3d to = from;
      to[random.integer(0, 2)] += random.real(-5.0, 5.0);
      const Eigen::Vector3d size_m = Eigen::Vector3d::Constant(random.real(0.1, 2.0));
      const bool is_blocked = obstacles.isAny(
          *grid.toCellBox({from.cwiseMin(to) - 0.5 * size_m, from.cwiseMax(to) + 0.5 * size_m}));
      const auto path = checkPath(scene->map, {from, to}, size_m, policy, Budget::unlimited());
      ASSERT_EQ(path.isFound(), is_blocked) << test::seedNote(i);
      num_blocked += is_blocked ? 1 : 0;
      if (i % 10 != 0) continue;
      const auto place = findNearestFit(scene->map, from, size_m, policy, 3.0, Budget::unlimited());
      if (!place.isFound()) continue;
      ASSERT_FALSE(obstacles.isAny(*grid.toCellBox(boxAround(place->center_map, size_m))))
          << test::seedNote(i);
      ++num_placed;
    }
  }
  EXPECT_GT(num_blocked, kCases / 5);
  EXPECT_LT(num_blocked, 2 * kCases);
  EXPECT_GT(num_placed, kCases / 20);
}

}  // namespace
}  // namespace cuboid_mapping
