// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/box_query.h"

#include "support/modelled_map.h"
#include "support/tree_queries.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace cuboid_mapping {
namespace {

using test::ModelledMap;
using test::Random;

/// A map at 1 m with y = z = 0: voxels x = 0 and 1 are free, x = 2 is occupied.
CuboidMap threeVoxels() {
  MapConfig config;
  config.resolution_m = 1.0;
  CuboidMap map(config);
  ScanUpdate update;
  update.bricks.emplace_back();
  test::markBox(update.bricks[0].misses, {{0, 0, 0}, {2, 1, 1}});
  test::markBox(update.bricks[0].hits, CellBox::ofCell({2, 0, 0}));
  map.apply(update);
  return map;
}

/// A box along the x axis, in the row of the three voxels.
MetricBox row(double min_x_m, double max_x_m) { return {{min_x_m, 0.0, 0.0}, {max_x_m, 1.0, 1.0}}; }

TEST(BoxQuery, dividesTheVolumeByClass) {
  const CuboidMap map = threeVoxels();
  const auto result = queryBox(map, row(-1.0, 5.0), Budget::unlimited());
  ASSERT_TRUE(result.isFound());
  EXPECT_EQ(result->box, (CellBox{{-1, 0, 0}, {5, 1, 1}}));
  EXPECT_DOUBLE_EQ(result->free_volume_m3, 2.0);
  EXPECT_DOUBLE_EQ(result->occupied_volume_m3, 1.0);
  EXPECT_DOUBLE_EQ(result->unknown_volume_m3, 3.0);
}

TEST(BoxQuery, countsEveryVoxelThatTheBoxOverlapsAsAWhole) {
  const auto result =
      queryBox(threeVoxels(), {{0.9, 0.4, 0.4}, {2.1, 0.6, 0.6}}, Budget::unlimited());
  ASSERT_TRUE(result.isFound());
  EXPECT_EQ(result->box, (CellBox{{0, 0, 0}, {3, 1, 1}}));
  EXPECT_DOUBLE_EQ(result->free_volume_m3, 2.0);
  EXPECT_DOUBLE_EQ(result->occupied_volume_m3, 1.0);
  EXPECT_DOUBLE_EQ(result->unknown_volume_m3, 0.0);
}

TEST(BoxQuery, doesNotCountAVoxelBehindAFace) {
  const auto result = queryBox(threeVoxels(), row(0.0, 2.0), Budget::unlimited());
  ASSERT_TRUE(result.isFound());
  EXPECT_EQ(result->occupied_volume_m3, 0.0);
  EXPECT_DOUBLE_EQ(result->free_volume_m3, 2.0);
}

TEST(BoxQuery, isOccupiedBeforeUnknownBeforeFree) {
  const CuboidMap map = threeVoxels();
  EXPECT_EQ(queryBox(map, row(0.0, 5.0), Budget::unlimited())->occupancy(), Occupancy::kOccupied);
  EXPECT_EQ(queryBox(map, row(-1.0, 2.0), Budget::unlimited())->occupancy(), Occupancy::kUnknown);
  EXPECT_EQ(queryBox(map, row(0.0, 2.0), Budget::unlimited())->occupancy(), Occupancy::kFree);
  EXPECT_EQ(queryBox(map, row(2.0, 3.0), Budget::unlimited())->occupancy(), Occupancy::kOccupied);
}

TEST(BoxQuery, isAllUnknownOutsideTheMap) {
  const auto result =
      queryBox(threeVoxels(), {{50.0, 50.0, 50.0}, {52.0, 52.0, 52.0}}, Budget::unlimited());
  ASSERT_TRUE(result.isFound());
  EXPECT_DOUBLE_EQ(result->unknown_volume_m3, 8.0);
  EXPECT_EQ(result->free_volume_m3 + result->occupied_volume_m3, 0.0);
  EXPECT_EQ(result->occupancy(), Occupancy::kUnknown);
  EXPECT_EQ(queryBox(CuboidMap(), row(0.0, 1.0), Budget::unlimited())->occupancy(),
            Occupancy::kUnknown);
}

TEST(BoxQuery, isFreeLooksNoFartherThanTheMapWhereUnknownSpaceIsFree) {
  const CuboidMap map = threeVoxels();
  QueryLimits limits;
  limits.max_bricks = 1;
  Budget budget(limits);
  EXPECT_TRUE(isFree(map, {{3, -1e6, -1e6}, {1e6, 1e6, 1e6}}, UnknownPolicy::kFree, budget));
  EXPECT_FALSE(isFree(map, {{2, -1e6, -1e6}, {1e6, 1e6, 1e6}}, UnknownPolicy::kFree, budget));
  EXPECT_FALSE(budget.isSpent());
}

TEST(BoxQuery, isNothingForABoxThatIsNoBox) {
  const CuboidMap map = threeVoxels();
  EXPECT_FALSE(queryBox(map, row(3.0, 0.0), Budget::unlimited()).isFound()) << "inverted";
  EXPECT_FALSE(queryBox(map, row(1.0, 1.0), Budget::unlimited()).isFound()) << "flat";
  EXPECT_FALSE(queryBox(map, row(std::nan(""), 1.0), Budget::unlimited()).isFound());
  EXPECT_FALSE(queryBox(map, row(0.0, std::nan("")), Budget::unlimited()).isFound());
  EXPECT_FALSE(queryBox(map, row(0.0, 1e10), Budget::unlimited()).isFound())
      << "out of the grid's range";
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(queryBox(map, row(-kInfinity, kInfinity), Budget::unlimited()).isFound());
}

/// Counts from reading every voxel of a box.
struct VoxelCounts {
  double num_free = 0.0;
  double num_occupied = 0.0;
};

VoxelCounts countVoxels(const test::VoxelMap& voxels, const CellBox& box) {
  VoxelCounts counts;
  test::visitCells(box, [&](const Cell& cell) {
    const auto log_odds = voxels.find(cell);
    if (!log_odds) return;
    ++(*log_odds >= 0.0F ? counts.num_occupied : counts.num_free);
  });
  return counts;
}

void checkBox(const ModelledMap& model, const CellBox& box, Random& random) {
  // A box in metres that overlaps these voxels, but ends before their faces.
  MetricBox metric = model.map.grid().toMetricBox(box);
  for (int axis = 0; axis < 3; ++axis) {
    metric.min_m[axis] += random.real(0.0, 0.049);
    metric.max_m[axis] -= random.real(0.0, 0.049);
  }
  const auto result = queryBox(model.map, metric, Budget::unlimited());
  ASSERT_TRUE(result.isFound());
  ASSERT_EQ(result->box, box);
  const VoxelCounts counts = countVoxels(model.voxels, box);
  const double voxel_m3 = 0.1 * 0.1 * 0.1;
  ASSERT_NEAR(result->free_volume_m3, counts.num_free * voxel_m3, 1e-9);
  ASSERT_NEAR(result->occupied_volume_m3, counts.num_occupied * voxel_m3, 1e-9);
  ASSERT_NEAR(result->free_volume_m3 + result->occupied_volume_m3 + result->unknown_volume_m3,
              box.numVoxels() * voxel_m3, 1e-9);
  ASSERT_EQ(isAnyOccupied(model.map, box), counts.num_occupied > 0.0);
  const bool is_full = counts.num_free == box.numVoxels();
  ASSERT_EQ(result->occupancy(), counts.num_occupied > 0.0
                                     ? Occupancy::kOccupied
                                     : (is_full ? Occupancy::kFree : Occupancy::kUnknown));
}

TEST(BoxQuery, agreesWithALookAtEveryVoxel) {
  Random random(1);
  std::size_t num_cases = 0;
  std::size_t num_by_class[3] = {0, 0, 0};
  for (const Cell& offset : {Cell{0, 0, 0}, Cell{10000000, -10000000, 800}, Cell{-8, 0, 8}}) {
    MapConfig config;
    config.resolution_m = 0.1;
    config.rtree = {4, 2};
    const ModelledMap model = randomMap(random, config, offset);
    const CellBox area{offset - Cell{18, 18, 18}, offset + Cell{17, 17, 17}};
    for (int i = 0; i < 4000; ++i, ++num_cases) {
      const CellBox box = test::randomBox(random, area, i % 2 == 0 ? 3 : 12);
      checkBox(model, box, random);
      ASSERT_FALSE(HasFailure()) << box << test::seedNote(num_cases);
      ++num_by_class[static_cast<std::size_t>(
          queryCells(model.map, box, Budget::unlimited())->occupancy())];
    }
  }
  EXPECT_EQ(num_cases, 12000U);
  for (const std::size_t count : num_by_class) EXPECT_GT(count, num_cases / 500);
}

}  // namespace
}  // namespace cuboid_mapping
