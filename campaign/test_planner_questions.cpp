// SPDX-License-Identifier: BSD-3-Clause
// Random questions of planners on maps of real scans; each answer is checked voxel by voxel.
//
// CUBOID_MAPPING_QUESTIONS sets the number of each kind on each map: 40 by default.
#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/query/corridor_query.h"
#include "cuboid_mapping/query/cuboid_query.h"
#include "cuboid_mapping/query/fit_query.h"
#include "cuboid_mapping/query/path_query.h"
#include "cuboid_mapping/query/ray_query.h"
#include "support/real_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace cuboid_mapping::campaign {
namespace {

using test::DenseObstacles;
using test::Random;
using test::Scene;

std::size_t numQuestions() {
  const char* text = std::getenv("CUBOID_MAPPING_QUESTIONS");
  return text == nullptr ? 40 : std::strtoull(text, nullptr, 10);
}

/// A map with the table of blocked voxels for a question's policy.
struct Room {
  const Scene& scene;
  UnknownPolicy policy;
  CellBox area;
  DenseObstacles obstacles;
  Random& random;

  [[nodiscard]] const CuboidMap& map() const { return scene.map; }
  [[nodiscard]] const Grid& grid() const { return scene.map.grid(); }
  Eigen::Vector3d randomPoint(double reach_m) {
    const auto& poses = scene.poses_map;
    return poses[random.index(poses.size())] + reach_m * test::randomPoint(random, 1.0);
  }
  /// Whether a box around a point is blocked, by its voxels.
  bool isBlocked(const Eigen::Vector3d& center, const Eigen::Vector3d& size_m) {
    return obstacles.isAny(*grid().toCellBox(boxAround(center, size_m)));
  }
};

testing::AssertionResult wrong(const char* what) { return testing::AssertionFailure() << what; }

testing::AssertionResult checkBoxQuestion(Room& room) {
  const Eigen::Vector3d from = room.randomPoint(10.0);
  const Eigen::Vector3d size = test::randomPoint(room.random, 2.0).cwiseAbs().array() + 0.05;
  const auto answer = queryBox(room.map(), MetricBox{from, from + size}, Budget::unlimited());
  if (!answer.isFound()) return wrong("no answer");
  double voxels[3] = {0, 0, 0};
  test::visitCells(answer->box, [&](const Cell& cell) {
    ++voxels[static_cast<int>(room.map().voxels().at(cell))];
  });
  const double volume_m3 = std::pow(room.grid().resolution(), 3);
  const auto is_volume = [&](double given_m3, Occupancy of) {
    return std::abs(given_m3 - volume_m3 * voxels[static_cast<int>(of)]) < 1e-9;
  };
  if (!is_volume(answer->free_volume_m3, Occupancy::kFree) ||
      !is_volume(answer->occupied_volume_m3, Occupancy::kOccupied) ||
      !is_volume(answer->unknown_volume_m3, Occupancy::kUnknown)) {
    return wrong("another volume");
  }
  double covered = 0.0;
  CuboidSelection clipped;
  clipped.is_clipped = true;
  const auto cuboids = selectCuboids(room.map(), answer->box, clipped, Budget::unlimited());
  for (const Cuboid& cuboid : cuboids.value) {
    bool is_of_class = answer->box.contains(cuboid.box);
    test::visitCells(cuboid.box, [&](const Cell& cell) {
      is_of_class = is_of_class && room.map().voxels().at(cell) == cuboid.occupancy;
    });
    if (!is_of_class) return wrong("a cuboid of another class");
    covered += cuboid.box.numVoxels();
  }
  const double known =
      voxels[static_cast<int>(Occupancy::kFree)] + voxels[static_cast<int>(Occupancy::kOccupied)];
  if (covered != known) return wrong("cuboids that do not cover the box");
  const bool is_occupied = voxels[static_cast<int>(Occupancy::kOccupied)] > 0;
  if (isAnyOccupied(room.map(), answer->box) != is_occupied) return wrong("occupied or not");
  return testing::AssertionSuccess();
}

/// Place at which a ray first enters a blocking voxel, from all its crossings of faces in order;
/// nothing if the ray passes a voxel on the way for less than a nanometre.
std::optional<double> findEnd(Room& room, const Eigen::Vector3d& origin,
                              const Eigen::Vector3d& along, double max_range_m) {
  std::vector<double> crossings{0.0, max_range_m};
  const double edge_m = room.grid().resolution();
  for (int axis = 0; axis < 3; ++axis) {
    if (along[axis] == 0.0) continue;
    const double last = (origin[axis] + max_range_m * along[axis]) / edge_m;
    const double first = origin[axis] / edge_m;
    for (double face = std::ceil(std::min(first, last)); face <= std::max(first, last); ++face) {
      const double at_m = (face * edge_m - origin[axis]) / along[axis];
      if (at_m > 0.0 && at_m < max_range_m) crossings.push_back(at_m);
    }
  }
  std::sort(crossings.begin(), crossings.end());
  for (std::size_t i = 1; i < crossings.size(); ++i) {
    if (crossings[i] - crossings[i - 1] < 1e-9) return std::nullopt;
    const Eigen::Vector3d middle = origin + 0.5 * (crossings[i - 1] + crossings[i]) * along;
    const Cell cell = *room.grid().toCell(middle);
    if (room.obstacles.isAny(CellBox::ofCell(cell))) return crossings[i - 1];
  }
  return max_range_m;
}

testing::AssertionResult checkRayQuestion(Room& room) {
  const Eigen::Vector3d origin = room.randomPoint(3.0);
  const Eigen::Vector3d along = test::randomDirection(room.random).normalized();
  const double max_range_m = room.random.real(0.5, 30.0);
  const auto expected_m = findEnd(room, origin, along, max_range_m);
  if (!expected_m) return testing::AssertionSuccess();
  const auto answer =
      castRay(room.map(), origin, along, max_range_m, room.policy, Budget::unlimited());
  if (!answer.isFound()) return wrong("no answer");
  if (std::abs(answer->distance_m - *expected_m) > 1e-7) return wrong("another distance");
  const bool is_stopped = *expected_m < max_range_m;
  if ((answer->end != RayEnd::kMaxRange) != is_stopped) return wrong("another end");
  if (answer->voxel && room.map().voxels().at(*answer->voxel) != Occupancy::kOccupied) {
    return wrong("a voxel that is not occupied");
  }
  return testing::AssertionSuccess();
}

/// Whether a box that moves along a segment is blocked at one of many places.
bool isBlockedOnTheWay(Room& room, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                       const Eigen::Vector3d& size_m) {
  constexpr double kMargin_m = 1e-5;
  const Eigen::Vector3d smaller = size_m.array() - 2.0 * kMargin_m;
  const int num_steps = 1 + static_cast<int>(20.0 * (to - from).norm() / room.grid().resolution());
  for (int i = 0; i <= num_steps; ++i) {
    if (room.isBlocked(from + (to - from) * i / num_steps, smaller)) return true;
  }
  return false;
}

testing::AssertionResult checkPathQuestion(Room& room) {
  std::vector<Eigen::Vector3d> way{room.randomPoint(3.0)};
  for (int i = room.random.integer(1, 3); i > 0; --i) {
    way.push_back(way.back() + test::randomPoint(room.random, 3.0));
  }
  const Eigen::Vector3d size_m = Eigen::Vector3d::Constant(room.random.real(0.1, 1.0));
  const auto answer = checkPath(room.map(), way, size_m, room.policy, Budget::unlimited());
  if (!answer.isFound() && !answer.isNotFound()) return wrong("no answer");
  const bool is_blocked_at_once = answer.isFound() && answer->distance_m == 0.0;
  for (std::size_t i = 0; i + 1 < way.size() && !is_blocked_at_once; ++i) {
    const bool is_last = answer.isFound() && answer->segment == i;
    const Eigen::Vector3d& to = is_last ? answer->point_map : way[i + 1];
    if (isBlockedOnTheWay(room, way[i], to, size_m)) return wrong("blocked before the contact");
    if (is_last) break;
  }
  if (answer.isNotFound()) return testing::AssertionSuccess();
  const PathContact& contact = *answer;
  if (!room.obstacles.isAny(CellBox::ofCell(contact.voxel))) return wrong("no obstacle there");
  const CellBox met = *room.grid().toCellBox(boxAround(contact.point_map, size_m.array() + 2e-4));
  return met.contains(contact.voxel) ? testing::AssertionSuccess() : wrong("a contact far away");
}

/// Whether a path from voxel to voxel leads a box from one place to another inside a region.
bool isConnected(Room& room, const CellBox& region, const Cell& size, const Cell& from,
                 const Cell& to) {
  std::set<Cell> seen{from};
  std::vector<Cell> open{from};
  while (!open.empty() && seen.count(to) == 0) {
    const Cell cell = open.back();
    open.pop_back();
    for (int direction = 0; direction < 6; ++direction) {
      Cell next = cell;
      next[direction / 2] += direction % 2 == 0 ? 1 : -1;
      const CellBox place{next, next + size};
      if (!region.contains(place) || room.obstacles.isAny(place)) continue;
      if (seen.insert(next).second) open.push_back(next);
    }
  }
  return seen.count(to) != 0;
}

testing::AssertionResult checkCorridor(Room& room, const CorridorTask& task, const Cell& size,
                                       const Corridor& corridor) {
  if (corridor.boxes.empty() || corridor.path_map.size() < 2) return wrong("an empty corridor");
  for (std::size_t i = 0; i < corridor.boxes.size(); ++i) {
    const CellBox& box = corridor.boxes[i];
    if (!task.region->contains(box) || room.obstacles.isAny(box)) return wrong("a blocked box");
    if (i == 0) continue;
    const Cell shared = intersect(box, corridor.boxes[i - 1]).size();
    if (shared.x < size.x || shared.y < size.y || shared.z < size.z) {
      return wrong("boxes that do not overlap by the robot");
    }
  }
  if (corridor.path_map.front() != task.start_map || corridor.path_map.back() != task.goal_map) {
    return wrong("other ends");
  }
  double length_m = 0.0;
  for (std::size_t i = 1; i < corridor.path_map.size(); ++i) {
    const Eigen::Vector3d& from = corridor.path_map[i - 1];
    const Eigen::Vector3d& to = corridor.path_map[i];
    if (isBlockedOnTheWay(room, from, to, task.size_m)) return wrong("a blocked path");
    length_m += (to - from).norm();
  }
  return std::abs(length_m - corridor.length_m) < 1e-9 ? testing::AssertionSuccess()
                                                       : wrong("another length");
}

testing::AssertionResult checkCorridorQuestion(Room& room) {
  CorridorTask task;
  task.size_m = Eigen::Vector3d::Constant(room.random.real(0.1, 0.8));
  const double edge_m = room.grid().resolution();
  const auto place = [&](const Eigen::Vector3d& near) {
    return findNearestFit(room.map(), near, task.size_m, room.policy, 10.0 * edge_m,
                          Budget::unlimited())
        .valueOr({near, 0.0})
        .center_map;
  };
  task.start_map = place(room.randomPoint(1.0));
  task.goal_map = place(task.start_map + test::randomPoint(room.random, 15.0 * edge_m));
  const Cell room_around{20, 20, 8};
  const CellBox start = *room.grid().toCellBox(boxAround(task.start_map, task.size_m));
  const CellBox goal = *room.grid().toCellBox(boxAround(task.goal_map, task.size_m));
  const CellBox both = unite(start, goal);
  task.region = CellBox{both.min - room_around, both.max + room_around};
  const auto corridor = findCorridor(room.map(), task, room.policy, Budget::unlimited());
  const Cell size = *room.grid().toSizeInCells(task.size_m);
  if (corridor.isFound()) return checkCorridor(room, task, size, *corridor);
  if (!corridor.isNotFound()) return wrong("no answer");
  switch (corridor.value.blocked) {
    case Blocked::kStart:
      return room.obstacles.isAny(start) ? testing::AssertionSuccess() : wrong("start is free");
    case Blocked::kGoal:
      return room.obstacles.isAny(goal) ? testing::AssertionSuccess() : wrong("goal is free");
    default:
      return isConnected(room, *task.region, size, start.min, goal.min)
                 ? wrong("there is a way")
                 : testing::AssertionSuccess();
  }
}

struct DataSet {
  const char* name;
  double resolution_m;
};

TEST(PlannerQuestions, areAnsweredAsEveryVoxelTells) {
  for (const DataSet& set : {DataSet{"kitti_0005_city", 0.2}, DataSet{"sim_fr079", 0.1},
                             DataSet{"rgbd_7scenes", 0.05}}) {
    const auto scene = test::readScene(set.name, set.resolution_m);
    if (!scene) GTEST_SKIP() << "CUBOID_DATA_DIR is not set: no real scans to test with";
    Random random(141);
    const CellBox area = *scene->map.bounds();
    for (const UnknownPolicy policy : {UnknownPolicy::kObstacle, UnknownPolicy::kFree}) {
      Room room{*scene, policy, area, test::makeObstacles(scene->map, area, policy), random};
      for (std::size_t i = 0; i < (numQuestions() + 1) / 2; ++i) {
        ASSERT_TRUE(checkBoxQuestion(room)) << set.name << ", box " << test::seedNote(i);
        ASSERT_TRUE(checkRayQuestion(room)) << set.name << ", ray " << test::seedNote(i);
        ASSERT_TRUE(checkPathQuestion(room)) << set.name << ", path " << test::seedNote(i);
        ASSERT_TRUE(checkCorridorQuestion(room)) << set.name << ", corridor " << test::seedNote(i);
      }
    }
    std::cout << set.name << ": " << 4 * numQuestions() << " questions" << std::endl;
  }
}

}  // namespace
}  // namespace cuboid_mapping::campaign
