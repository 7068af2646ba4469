// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/nearest_query.h"

#include "cuboid_mapping/query/point_query.h"

#include "support/modelled_map.h"
#include "support/tree_queries.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace cuboid_mapping {
namespace {

using test::ModelledMap;
using test::Random;

/// A map at 0.5 m with y = z = 0: voxel x = 0 is free, x = 4 and x = 7 are occupied.
CuboidMap threeInARow() {
  MapConfig config;
  config.resolution_m = 0.5;
  CuboidMap map(config);
  ScanUpdate update;
  update.bricks.emplace_back();
  test::markBox(update.bricks[0].misses, CellBox::ofCell({0, 0, 0}));
  test::markBox(update.bricks[0].hits, CellBox::ofCell({4, 0, 0}));
  test::markBox(update.bricks[0].hits, CellBox::ofCell({7, 0, 0}));
  map.apply(update);
  return map;
}

TEST(NearestQuery, givesTheNearestFirstWithItsClosestPoint) {
  const auto nearest = findNearest(threeInARow(), {0.25, 0.25, 0.25}, 2, CuboidFilter::kOccupied,
                                   Budget::unlimited())
                           .value;
  ASSERT_EQ(nearest.size(), 2U);
  EXPECT_EQ(nearest[0].cuboid.box, CellBox::ofCell({4, 0, 0}));
  EXPECT_NEAR(nearest[0].distance_m, 1.75, 1e-12);
  EXPECT_TRUE(nearest[0].closest_point_map.isApprox(Eigen::Vector3d(2.0, 0.25, 0.25)));
  EXPECT_EQ(nearest[1].cuboid.box, CellBox::ofCell({7, 0, 0}));
  EXPECT_NEAR(nearest[1].distance_m, 3.25, 1e-12);
}

TEST(NearestQuery, isAtDistanceZeroInACuboidAndOnItsFace) {
  for (const double x_m : {2.0, 2.25, 2.5}) {
    const Eigen::Vector3d point(x_m, 0.25, 0.25);
    const auto nearest =
        findNearest(threeInARow(), point, 1, CuboidFilter::kAll, Budget::unlimited()).value;
    ASSERT_EQ(nearest.size(), 1U);
    EXPECT_EQ(nearest[0].cuboid.box, CellBox::ofCell({4, 0, 0})) << x_m;
    EXPECT_EQ(nearest[0].distance_m, 0.0) << x_m;
    EXPECT_TRUE(nearest[0].closest_point_map.isApprox(point)) << x_m;
  }
}

TEST(NearestQuery, givesAsManyAsThereAre) {
  const CuboidMap map = threeInARow();
  const Eigen::Vector3d point(0.25, 0.25, 0.25);
  EXPECT_EQ(findNearest(map, point, 10, CuboidFilter::kAll, Budget::unlimited()).value.size(), 3U);
  EXPECT_EQ(findNearest(map, point, 10, CuboidFilter::kFree, Budget::unlimited()).value.size(), 1U);
  EXPECT_EQ(findNearest(map, point, 10, CuboidFilter::kOccupied, Budget::unlimited()).value.size(),
            2U);
  EXPECT_EQ(
      findNearest(map, point, 10, CuboidFilter::kOccupied, Budget::unlimited(), 1.76).value.size(),
      1U);
  EXPECT_EQ(
      findNearest(map, point, 10, CuboidFilter::kOccupied, Budget::unlimited(), 1.74).value.size(),
      0U);
  EXPECT_EQ(
      findNearest(CuboidMap(), point, 10, CuboidFilter::kAll, Budget::unlimited()).value.size(),
      0U);
}

TEST(NearestQuery, needNotStartInTheMap) {
  const CuboidMap map = threeInARow();
  EXPECT_EQ(
      findNearest(map, {1e12, 0.0, 0.0}, 1, CuboidFilter::kAll, Budget::unlimited()).value.size(),
      1U);
  EXPECT_TRUE(findNearest(map, {100.0, 0.0, 0.0}, 1, CuboidFilter::kAll, Budget::unlimited(), 5.0)
                  .value.empty());
}

TEST(NearestQuery, includesTheCuboidOfThePointAtMaxDistanceZero) {
  const auto nearest = findNearest(threeInARow(), {2.25, 0.25, 0.25}, 5, CuboidFilter::kAll,
                                   Budget::unlimited(), 0.0)
                           .value;
  ASSERT_EQ(nearest.size(), 1U);
  EXPECT_EQ(nearest[0].cuboid.box, CellBox::ofCell({4, 0, 0}));
}

TEST(NearestQuery, isNothingForWhatIsNoQuery) {
  const CuboidMap map = threeInARow();
  const Eigen::Vector3d point(0.25, 0.25, 0.25);
  EXPECT_TRUE(findNearest(map, point, 0, CuboidFilter::kAll, Budget::unlimited()).value.empty());
  EXPECT_TRUE(
      findNearest(map, point, 1, CuboidFilter::kAll, Budget::unlimited(), -0.1).value.empty());
  EXPECT_TRUE(findNearest(map, point, 1, CuboidFilter::kAll, Budget::unlimited(), std::nan(""))
                  .value.empty());
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double bad : {std::nan(""), kInfinity, -kInfinity}) {
    EXPECT_TRUE(findNearest(map, {0.25, bad, 0.25}, 1, CuboidFilter::kAll, Budget::unlimited())
                    .value.empty())
        << bad;
  }
}

/// Distances of all cuboids of a class from a point, in metres, sorted.
std::vector<double> sortedDistances(const std::vector<Cuboid>& cuboids,
                                    const Eigen::Vector3d& point_cells, CuboidFilter filter) {
  std::vector<double> distances_m;
  for (const Cuboid& cuboid : cuboids) {
    if (!test::passes(filter, cuboid)) continue;
    distances_m.push_back(0.1 * test::distanceTo(point_cells, cuboid.box));
  }
  std::sort(distances_m.begin(), distances_m.end());
  return distances_m;
}

void checkNearest(const CuboidMap& map, const std::vector<Cuboid>& all,
                  const Eigen::Vector3d& point, Random& random) {
  const CuboidFilter filter = test::kFilters[random.index(3)];
  const std::size_t k = 1 + random.index(12);
  const double max_distance_m =
      random.chance(0.5) ? std::numeric_limits<double>::infinity() : random.real(0.0, 1.0);
  const std::vector<NearestCuboid> nearest =
      findNearest(map, point, k, filter, Budget::unlimited(), max_distance_m).value;

  const Eigen::Vector3d point_cells = map.grid().toCellUnits(point);
  std::vector<double> expected_m = sortedDistances(all, point_cells, filter);
  expected_m.erase(std::upper_bound(expected_m.begin(), expected_m.end(), max_distance_m),
                   expected_m.end());
  expected_m.resize(std::min(k, expected_m.size()));
  ASSERT_EQ(nearest.size(), expected_m.size());
  std::vector<Cuboid> found;
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    const NearestCuboid& near = nearest[i];
    found.push_back(near.cuboid);
    ASSERT_NEAR(near.distance_m, expected_m[i], 1e-9);
    ASSERT_TRUE(test::passes(filter, near.cuboid));
    ASSERT_NEAR(0.1 * test::distanceTo(point_cells, near.cuboid.box), near.distance_m, 1e-9);
    ASSERT_NEAR((near.closest_point_map - point).norm(), near.distance_m, 1e-8);
    ASSERT_NEAR((near.distance_m * near.direction_map - near.closest_point_map + point).norm(), 0.0,
                1e-8);
    ASSERT_NEAR(near.direction_map.norm(), near.closest_point_map == point ? 0.0 : 1.0, 1e-9);
    ASSERT_LT(test::distanceTo(map.grid().toCellUnits(near.closest_point_map), near.cuboid.box),
              1e-7);
    ASSERT_TRUE(findCuboidOfCell(map, near.cuboid.box.min) == near.cuboid) << "not in the map";
  }
  found = test::sorted(std::move(found));
  ASSERT_TRUE(std::adjacent_find(found.begin(), found.end()) == found.end()) << "one twice";
}

TEST(NearestQuery, agreesWithALookAtEveryCuboid) {
  Random random(1);
  std::size_t num_cases = 0;
  for (const Cell& offset : {Cell{0, 0, 0}, Cell{10000000, -10000000, 800}, Cell{-8, 0, 8}}) {
    MapConfig config;
    config.resolution_m = 0.1;
    config.rtree = {16, 6};
    const ModelledMap model = randomMap(random, config, offset);
    const std::vector<Cuboid> all = test::allCuboids(model.map);
    ASSERT_GT(all.size(), 100U);
    const Eigen::Vector3d center = 0.1 * Eigen::Vector3d(offset.x, offset.y, offset.z);
    for (int i = 0; i < 4000; ++i, ++num_cases) {
      const Eigen::Vector3d point = center + test::randomPoint(random, i % 10 == 0 ? 20.0 : 3.0);
      checkNearest(model.map, all, point, random);
      ASSERT_FALSE(HasFailure()) << point.transpose() << test::seedNote(num_cases);
    }
  }
  EXPECT_EQ(num_cases, 12000U);
}

}  // namespace
}  // namespace cuboid_mapping
