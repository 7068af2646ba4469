// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/frontier_query.h"

#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/query/fit_query.h"
#include "cuboid_mapping/query/ray_query.h"
#include "support/random_bricks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <set>

namespace cuboid_mapping {
namespace {

using test::Random;

constexpr CellBox kFrontierArea{{-16, -16, -8}, {16, 16, 8}};

/// Frontier voxels found by checking each voxel and its neighbours.
std::set<Cell> findVoxels(const CuboidMap& map, const CellBox& region) {
  std::set<Cell> found;
  test::visitCells(intersect(region, kFrontierArea), [&](const Cell& cell) {
    if (map.voxels().at(cell) != Occupancy::kFree) return;
    for (int axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) {
        Cell beside = cell;
        beside[axis] += step;
        if (map.voxels().at(beside) == Occupancy::kUnknown) found.insert(cell);
      }
    }
  });
  return found;
}

double distanceToMean(const std::vector<Cell>& voxels, const Eigen::Vector3d& of) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Cell& cell : voxels) mean += Eigen::Vector3d(cell.x, cell.y, cell.z);
  return (of - mean / static_cast<double>(voxels.size())).norm();
}

bool touch(const Cell& a, const Cell& b) {
  return std::abs(a.x - b.x) <= 1 && std::abs(a.y - b.y) <= 1 && std::abs(a.z - b.z) <= 1;
}

/// Clusters found by painting each voxel with the colours of earlier neighbours.
std::set<std::set<Cell>> findClusters(const std::set<Cell>& voxels) {
  std::set<std::set<Cell>> clusters;
  for (const Cell& cell : voxels) {
    std::set<Cell> joined{cell};
    for (auto cluster = clusters.begin(); cluster != clusters.end();) {
      const bool is_near = std::any_of(cluster->begin(), cluster->end(),
                                       [&](const Cell& other) { return touch(cell, other); });
      if (is_near) joined.insert(cluster->begin(), cluster->end());
      cluster = is_near ? clusters.erase(cluster) : std::next(cluster);
    }
    clusters.insert(joined);
  }
  return clusters;
}

TEST(FrontierQuery, findsTheVoxelsBesideUnknownSpaceInClusters) {
  Random random(3921);
  std::size_t num_frontiers = 0;
  for (std::size_t i = 0; i < 40; ++i) {
    SCOPED_TRACE(test::seedNote(i));
    const CuboidMap map = test::mapOfUpdates(random, 8);
    FrontierTask task;
    task.view_range_m = 0.0;
    task.max_distance_m = 0.0;
    if (random.chance(0.5)) task.region = test::randomBoxInside(random, kFrontierArea);
    task.min_voxels = random.index(4);
    std::set<std::set<Cell>> expected;
    for (const std::set<Cell>& cluster : findClusters(findVoxels(map, task.region))) {
      if (cluster.size() >= task.min_voxels) expected.insert(cluster);
    }
    const auto found = findFrontiers(map, task, Budget::unlimited());
    ASSERT_TRUE(found.isFound() || found.isNotFound());
    std::set<std::set<Cell>> clusters;
    std::size_t last = std::numeric_limits<std::size_t>::max();
    for (const Frontier& frontier : found.value) {
      clusters.insert({frontier.voxels.begin(), frontier.voxels.end()});
      EXPECT_LE(frontier.voxels.size(), last) << "the largest first";
      last = frontier.voxels.size();
      const Cell center = map.grid().toCell(frontier.center_map).value();
      const double distance =
          distanceToMean(frontier.voxels, {1.0 * center.x, 1.0 * center.y, 1.0 * center.z});
      for (const Cell& cell : frontier.voxels) {
        EXPECT_LE(
            distance,
            distanceToMean(frontier.voxels, {1.0 * cell.x, 1.0 * cell.y, 1.0 * cell.z}) + 1e-9);
      }
    }
    ASSERT_EQ(clusters, expected);
    num_frontiers += clusters.size();
  }
  EXPECT_GT(num_frontiers, 200U);
}

/// Volume found by a ray to the centre of each voxel in the range.
double seeUnknown(const CuboidMap& map, const Eigen::Vector3d& from, double range_m) {
  double volume_m3 = 0.0;
  test::visitCells({{-27, -27, -19}, {27, 27, 19}}, [&](const Cell& cell) {
    const Eigen::Vector3d to_cell = map.grid().centerOf(CellBox::ofCell(cell)) - from;
    if (map.voxels().at(cell) != Occupancy::kUnknown || to_cell.norm() > range_m) return;
    const auto ray =
        castRay(map, from, to_cell, to_cell.norm(), UnknownPolicy::kFree, Budget::unlimited());
    if (!ray.isFound() || ray->end == RayEnd::kMaxRange) volume_m3 += map.grid().voxelVolume();
  });
  return volume_m3;
}

TEST(FrontierQuery, saysWhereToStandAndWhatIsSeenFromThere) {
  Random random(3922);
  std::size_t num_places = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    SCOPED_TRACE(test::seedNote(i));
    CuboidMap map = test::mapOfUpdates(random, 8);
    map.replace({{-6, -6, -6}, {6, 6, 6}},
                std::vector<UniformBox>{{{{-6, -6, -6}, {6, 6, 6}}, -1.0F}});
    FrontierTask task;
    task.size_m = Eigen::Vector3d::Constant(0.09);
    task.max_distance_m = 0.3;
    task.view_range_m = random.real(0.2, 0.5);
    const auto found = findFrontiers(map, task, Budget::unlimited());
    for (std::size_t k = 0; k < std::min<std::size_t>(3, found.value.size()); ++k) {
      const Frontier& frontier = found.value[k];
      const auto place =
          findNearestFit(map, frontier.center_map, task.size_m, UnknownPolicy::kObstacle,
                         task.max_distance_m, Budget::unlimited());
      ASSERT_EQ(frontier.place_map.has_value(), place.isFound());
      if (!place.isFound()) continue;
      ASSERT_EQ(*frontier.place_map, place->center_map);
      ++num_places;
      EXPECT_LE(place->distance_m, task.max_distance_m + 1e-9);
      EXPECT_NEAR(frontier.unknown_volume_m3, seeUnknown(map, place->center_map, task.view_range_m),
                  1e-9);
    }
  }
  EXPECT_GT(num_places, 5U);
}

TEST(FrontierQuery, refusesNumbersOutsideTheirRanges) {
  const CuboidMap map;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  FrontierTask task;
  EXPECT_TRUE(findFrontiers(map, task, Budget::unlimited()).isNotFound());
  for (const double wrong : {0.0, -1.0, 1e9, nan, std::numeric_limits<double>::infinity()}) {
    task.size_m.y() = wrong;
    EXPECT_FALSE(findFrontiers(map, task, Budget::unlimited()).fault.empty()) << wrong;
  }
  task = {};
  for (const double wrong : {-1.0, nan, std::numeric_limits<double>::infinity()}) {
    task.view_range_m = wrong;
    EXPECT_FALSE(findFrontiers(map, task, Budget::unlimited()).fault.empty()) << wrong;
    task = {};
    task.max_distance_m = wrong;
    EXPECT_FALSE(findFrontiers(map, task, Budget::unlimited()).fault.empty()) << wrong;
    task = {};
  }
  task.max_distance_m = 1e9;
  EXPECT_FALSE(findFrontiers(map, task, Budget::unlimited()).fault.empty())
      << "no frontier would have a place to stand";
  task.view_range_m = 501 * map.grid().resolution();
  EXPECT_FALSE(findFrontiers(map, task, Budget::unlimited()).fault.empty())
      << "a kilometre of rays";
  task = {};
  task.region = {};
  EXPECT_FALSE(findFrontiers(map, task, Budget::unlimited()).fault.empty()) << "an empty region";
}

TEST(FrontierQuery, goesOnAfterAnEarlierAnswer) {
  Random random(3924);
  const CuboidMap map = test::mapOfUpdates(random, 8);
  FrontierTask task;
  const auto all = findFrontiers(map, task, Budget::unlimited());
  ASSERT_GT(all.value.size(), 3U);
  std::vector<Eigen::Vector3d> centers;
  for (std::size_t calls = 0; calls < all.value.size() + 1; ++calls) {
    Budget two(QueryLimits{std::numeric_limits<double>::infinity(),
                           std::numeric_limits<std::uint64_t>::max(), 2});
    task.first = centers.size();
    const auto part = findFrontiers(map, task, two);
    ASSERT_LE(part.value.size(), 2U);
    for (const Frontier& frontier : part.value) centers.push_back(frontier.center_map);
    if (part.status != AnswerStatus::kBudgetSpent) break;
  }
  ASSERT_EQ(centers.size(), all.value.size());
  for (std::size_t i = 0; i < centers.size(); ++i) EXPECT_EQ(centers[i], all.value[i].center_map);
}

TEST(FrontierQuery, endsWithItsBudget) {
  Random random(3923);
  const CuboidMap map = test::mapOfUpdates(random, 8);
  QueryLimits limits;
  limits.max_entries = 1;
  Budget entries(limits);
  const auto one = findFrontiers(map, {}, entries);
  EXPECT_EQ(one.status, AnswerStatus::kBudgetSpent);
  EXPECT_EQ(one.value.size(), 1U);
  limits = {};
  limits.max_bricks = 3;
  Budget bricks(limits);
  EXPECT_EQ(findFrontiers(map, {}, bricks).status, AnswerStatus::kBudgetSpent);
}

/// A free plane of 200 x 200 voxels has 625 bricks, and 40,000 voxels beside unknown ones.
TEST(FrontierQuery, spendsItsBudgetOnVoxelsAndLetsOthersHaveTheirTurn) {
  MapConfig config;
  config.resolution_m = 1.0;
  CuboidMap map(config);
  map.replace(kAllCells, {{{{0, 0, 0}, {200, 200, 1}}, -1.0F}});
  QueryLimits limits;
  limits.max_bricks = 20000;
  Budget bricks(limits);
  const auto found = findFrontiers(map, {}, bricks);
  EXPECT_EQ(found.status, AnswerStatus::kBudgetSpent);
  EXPECT_TRUE(found.value.empty()) << "a part of a cluster is none";

  FrontierTask task;
  task.min_voxels = 1000000;
  int num_turns = 0;
  Budget turns({}, {[&] { ++num_turns; }, 0.0, nullptr});
  EXPECT_TRUE(findFrontiers(map, task, turns).isNotFound());
  EXPECT_GT(num_turns, 100);
}

}  // namespace
}  // namespace cuboid_mapping
