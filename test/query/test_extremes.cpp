// SPDX-License-Identifier: BSD-3-Clause
// Every query on odd maps, with questions at the limits of the grid: it ends, and says nothing that is wrong. With
// sanitizers, no number overflows.
#include "cuboid_mapping/boxes/box_cover.h"
#include "cuboid_mapping/boxes/free_boxes.h"
#include "cuboid_mapping/boxes/joined_cuboids.h"
#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/query/corridor_query.h"
#include "cuboid_mapping/query/cuboid_query.h"
#include "cuboid_mapping/query/distance_field.h"
#include "cuboid_mapping/query/fit_query.h"
#include "cuboid_mapping/query/frontier_query.h"
#include "cuboid_mapping/query/motion_query.h"
#include "cuboid_mapping/query/nearest_query.h"
#include "cuboid_mapping/query/obstacle_distance.h"
#include "cuboid_mapping/query/path_query.h"
#include "cuboid_mapping/query/point_query.h"
#include "cuboid_mapping/query/pose_path.h"
#include "cuboid_mapping/query/pose_query.h"
#include "cuboid_mapping/query/ray_query.h"
#include "cuboid_mapping/query/sphere_query.h"
#include "cuboid_mapping/query/value_query.h"

#include <gtest/gtest.h>

#include <limits>
#include <utility>
#include <vector>

namespace cuboid_mapping {
namespace {

constexpr double kCoarse_m = 0.25;
constexpr double kNearEnd_m = (Grid::kMaxCell - 16) * kCoarse_m;  ///< Near the end of the grid.
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr CellBox kLast{{Grid::kMaxCell - 1, Grid::kMaxCell - 1, Grid::kMaxCell - 1},
                        {Grid::kMaxCell, Grid::kMaxCell, Grid::kMaxCell}};
constexpr CellBox kFirst{{-Grid::kMaxCell, -Grid::kMaxCell, -Grid::kMaxCell},
                         {1 - Grid::kMaxCell, 1 - Grid::kMaxCell, 1 - Grid::kMaxCell}};

constexpr std::int32_t kMost = std::numeric_limits<std::int32_t>::max();
constexpr std::int32_t kLeast = std::numeric_limits<std::int32_t>::min();
constexpr CellBox kBeyond{{kMost - 3, 0, kMost - 3}, {kMost, 3, kMost}};
constexpr CellBox kBelow{{kLeast, 0, kLeast}, {kLeast + 3, 3, kLeast + 3}};
constexpr CellBox kWhole{{kLeast, kLeast, kLeast}, {kMost, kMost, kMost}};

/// Numbers that a broken program asks about, and numbers at the limits.
const std::vector<double> kCoordinates{0.0,   kNearEnd_m, -kNearEnd_m, 4.0 * kNearEnd_m, 1e18,
                                       -1e18, 1e300,      -1e308,      1e-300,           -0.0,
                                       kNaN,  kInfinity,  -kInfinity};

std::vector<CuboidMap> oddMaps() {
  MapConfig config;
  config.resolution_m = kCoarse_m;
  std::vector<CuboidMap> maps;
  for (const auto& boxes : std::vector<std::vector<UniformBox>>{
           {},
           {{kLast, 1.0F}},
           {{kFirst, -1.0F}, {kLast, 1.0F}, {{{0, 0, 0}, {9, 9, 9}}, -1.0F}},
           {{{{-8, -8, -8}, {8, 8, 8}}, -1.0F}, {{{0, 0, 0}, {1, 1, 1}}, 1.0F}}}) {
    maps.emplace_back(config);
    maps.back().replace(kAllCells, boxes);
  }
  return maps;
}

/// Points with each coordinate on one axis, and on all of them.
std::vector<Eigen::Vector3d> oddPoints() {
  std::vector<Eigen::Vector3d> points;
  for (const double value : kCoordinates) {
    points.push_back(Eigen::Vector3d::Constant(value));
    for (int axis = 0; axis < 3; ++axis) {
      points.push_back(Eigen::Vector3d::Constant(0.1));
      points.back()[axis] = value;
    }
  }
  return points;
}

/// Calls ask(map, policy, budget) for each map and policy, with a budget that ends soon.
template <typename AskT>
void askAll(AskT ask) {
  for (const CuboidMap& map : oddMaps()) {
    for (const UnknownPolicy policy : {UnknownPolicy::kFree, UnknownPolicy::kObstacle}) {
      ask(map, policy);
    }
  }
}

Budget small() { return Budget(QueryLimits{0.05, 20'000}); }

bool isInGrid(const Eigen::Vector3d& point) {
  return (point.array().abs() <= Grid::kMaxCell * kCoarse_m).all();
}

TEST(Extremes, ofPoints) {
  askAll([](const CuboidMap& map, UnknownPolicy policy) {
    for (const Eigen::Vector3d& point : oddPoints()) {
      const bool is_known = findCuboid(map, point).has_value();
      EXPECT_EQ(is_known, classifyPoint(map, point) != Occupancy::kUnknown);
      EXPECT_TRUE(!is_known || isInGrid(point));
      Budget budget = small();
      const auto nearest = findNearest(map, point, 2, CuboidFilter::kAll, budget);
      EXPECT_EQ(nearest.status == AnswerStatus::kInvalid, !point.allFinite());
      EXPECT_TRUE(!point.allFinite() || nearest.isFound() == map.bounds().has_value()) << point;
      for (const double bound_m : {1.0, 1e300, kInfinity}) {
        Budget few = small();
        const auto found = findObstacleDistance(map, point, bound_m, policy, few);
        EXPECT_TRUE(!found.isFound() || isInGrid(point));
      }
      Budget for_fit = small();
      const Eigen::Vector3d size_m(0.5, 0.5, 0.5);
      EXPECT_TRUE(isInGrid(point) ||
                  findNearestFit(map, point, size_m, policy, 3.0, for_fit).status ==
                      AnswerStatus::kInvalid);
    }
  });
}

TEST(Extremes, ofRays) {
  askAll([](const CuboidMap& map, UnknownPolicy policy) {
    for (const Eigen::Vector3d& origin : oddPoints()) {
      for (const Eigen::Vector3d& to : oddPoints()) {
        for (const double range_m : {1e-300, 10.0, 1e300, kInfinity}) {
          Budget budget = small();
          const auto ray = castRay(map, origin, to, range_m, policy, budget);
          const auto hit = findFirstHit(map, origin, to, range_m, budget);
          const bool is_ray =
              origin.allFinite() && to.allFinite() && !to.isZero(0.0) && range_m < kInfinity;
          EXPECT_EQ(ray.status != AnswerStatus::kInvalid, is_ray);
          EXPECT_EQ(hit.status != AnswerStatus::kInvalid, is_ray);
          EXPECT_LE(ray.valueOr({}).distance_m, range_m);
        }
      }
    }
  });
}

TEST(Extremes, ofBoxes) {
  askAll([](const CuboidMap& map, UnknownPolicy policy) {
    for (const Eigen::Vector3d& a : oddPoints()) {
      for (const Eigen::Vector3d& b : oddPoints()) {
        Budget budget = small();
        const auto box = queryBox(map, {a, b}, budget);
        const bool is_box = isInGrid(a) && isInGrid(b) && (a.array() < b.array()).all();
        EXPECT_EQ(box.status != AnswerStatus::kInvalid, is_box) << a << '\n' << b;
        Budget few = small();
        EXPECT_TRUE(is_box || !isFree(map, {a, b}, policy, few));
      }
    }
    for (const CellBox& cells : {kAllCells, kFirst, kLast, CellBox{}, kBeyond, kBelow, kWhole}) {
      Budget budget = small();
      const auto found = queryCells(map, cells, budget);
      EXPECT_EQ(found->occupied_volume_m3 > 0.0, isAnyOccupied(map, cells));
      EXPECT_NEAR(found->free_volume_m3 + found->occupied_volume_m3 + found->unknown_volume_m3,
                  cells.numVoxels() * map.grid().voxelVolume(), 1e-9 * cells.numVoxels());
      EXPECT_EQ(maxLogOdds(map, cells, budget).isFound(),
                meanProbability(map, cells, budget).isFound());
      const auto cuboids = selectCuboids(map, cells, {}, budget);
      EXPECT_EQ(cuboids.isFound(), maxLogOdds(map, cells, budget).isFound());
      EXPECT_EQ(cuboids.isFound(), joinCuboids(map, cells, CuboidFilter::kAll, budget).isFound());
      EXPECT_LE(buildFreeGraph(map, cells, {1, 1, 1}, budget).value.portals.size(), 100U);
      EXPECT_FALSE(budget.isSpent());
    }
  });
}

TEST(Extremes, ofPaths) {
  askAll([](const CuboidMap& map, UnknownPolicy policy) {
    for (const Eigen::Vector3d& from : oddPoints()) {
      for (const Eigen::Vector3d& to : oddPoints()) {
        for (const double size_m : {0.5, 1e8, 1e300, kNaN}) {
          const Eigen::Vector3d edges_m = Eigen::Vector3d::Constant(size_m);
          Budget budget = small();
          const auto path = checkPath(map, {from, to}, edges_m, policy, budget);
          const bool is_long = (to - from).norm() > 1e6;
          // Nobody has looked at so many bricks.
          EXPECT_FALSE(is_long && path.isNotFound()) << from << '\n' << to;
          Budget few = small();
          EXPECT_FALSE(is_long && isPathFree(map, {from, to}, edges_m, policy, few));
        }
      }
    }
  });
}

TEST(Extremes, ofWays) {
  askAll([](const CuboidMap& map, UnknownPolicy policy) {
    for (const double x : kCoordinates) {
      CorridorTask task;
      task.start_map = {x, 0.5, 0.5};
      task.goal_map = {-x, 0.5, 0.5};
      task.size_m = {0.5, 0.5, 0.5};
      for (const double tolerance_m : {0.0, 1.0, kInfinity}) {
        task.start_tolerance_m = task.goal_tolerance_m = tolerance_m;
        Budget budget = small();
        EXPECT_FALSE(std::abs(x) > 1e6 && findCorridor(map, task, policy, budget).isFound());
      }
      PosePathTask turning;
      turning.body.spheres.push_back({Eigen::Vector3d::Zero(), 0.3});
      turning.start_map.translation() = Eigen::Vector3d(0.1, 0.1, x);
      turning.goal_map.translation() = Eigen::Vector3d(0.1, 0.1, -x);
      turning.may_climb = true;
      for (const double tolerance_m : {0.0, 1.0, kInfinity}) {
        turning.start_tolerance_m = turning.goal_tolerance_m = tolerance_m;
        Budget budget = small();
        EXPECT_FALSE(std::abs(x) > 1e6 && findPosePath(map, turning, policy, budget).isFound());
      }
    }
  });
}

TEST(Extremes, ofBodies) {
  askAll([](const CuboidMap& map, UnknownPolicy policy) {
    for (const double radius_m : {0.3, 1e3, 1e300, kNaN}) {
      const Body body{{{Eigen::Vector3d::Zero(), radius_m}}, {}};
      std::vector<Eigen::Isometry3d> poses;
      std::vector<Sphere> spheres;
      for (const Eigen::Vector3d& point : oddPoints()) {
        poses.emplace_back(Eigen::Translation3d(point));
        spheres.push_back({point, radius_m});
      }
      Budget budget = small();
      const auto contacts = checkPoses(map, body, poses, policy, budget);
      Budget few = small();
      const auto answers = SphereChecker(map, policy, few).check(spheres);
      for (std::size_t i = 0; i < poses.size(); ++i) {
        EXPECT_TRUE(contacts[i].status == answers[i] || budget.isSpent()) << spheres[i].center_map;
        const bool is_in_grid = isInGrid(spheres[i].center_map);
        EXPECT_TRUE(is_in_grid || answers[i] == AnswerStatus::kInvalid || few.isSpent());
        Budget for_motion = small();
        const auto motion = checkMotion(map, body, {poses[0], poses[i]}, policy, for_motion);
        EXPECT_FALSE(spheres[i].center_map.norm() > 1e6 && motion.isNotFound());
      }
    }
  });
}

TEST(Extremes, ofRegions) {
  askAll([](const CuboidMap& map, UnknownPolicy policy) {
    for (const CellBox& region : {kAllCells, kFirst, kLast, CellBox{}, kBeyond, kBelow, kWhole}) {
      Budget budget = small();
      FrontierTask frontiers;
      frontiers.region = region;
      frontiers.size_m = {0.5, 0.5, 0.5};
      const auto found = findFrontiers(map, frontiers, budget);
      EXPECT_EQ(found.status == AnswerStatus::kInvalid, region.isEmpty());
      Budget for_boxes = small();
      FreeBoxesTask boxes;
      boxes.max_boxes = 5;
      boxes.region = region;
      EXPECT_EQ(findFreeBoxes(map, boxes, for_boxes).status == AnswerStatus::kInvalid,
                region.isEmpty());
      Budget for_cover = small();
      CoverTask cover;
      cover.max_boxes = 1;
      cover.region = region;
      cover.previous = {kAllCells, kFirst, {}};
      cover.keep_free = {kFirst};
      EXPECT_EQ(coverOccupied(map, cover, for_cover).status == AnswerStatus::kInvalid,
                region.isEmpty());
      if (region == kFirst || region == kLast) {
        const DistanceField field(map, region, 2.0, policy);
        EXPECT_FALSE(field.distanceAt(Eigen::Vector3d::Constant(kNaN)));
        EXPECT_TRUE(field.distanceAt(map.grid().centerOf(region)));
      } else {
        EXPECT_THROW(DistanceField(map, region, 2.0, policy), std::invalid_argument);
      }
    }
  });
}

}  // namespace
}  // namespace cuboid_mapping
