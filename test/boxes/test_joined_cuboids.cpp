// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/boxes/joined_cuboids.h"

#include "support/cuboid_set.h"
#include "support/random_bricks.h"

#include <gtest/gtest.h>

#include <atomic>
#include <limits>
#include <map>

namespace cuboid_mapping {
namespace {

using test::Random;

constexpr CellBox kAreaInBricks{{-2, -2, -1}, {2, 2, 1}};
constexpr CellBox kJoinedArea{{-16, -16, -8}, {16, 16, 8}};

std::vector<ScanUpdate> randomUpdates(Random& random) {
  std::vector<ScanUpdate> updates;
  const int count = random.integer(1, 12);
  for (int i = 0; i < count; ++i) {
    updates.push_back(test::randomUpdate(random, kAreaInBricks, 24));
  }
  return updates;
}

CuboidMap makeMap(const std::vector<ScanUpdate>& updates, const MapConfig& config = {}) {
  CuboidMap map(config);
  for (const ScanUpdate& update : updates) map.apply(update);
  return map;
}

/// Whether the union of two boxes is a box.
bool shareWholeFace(const CellBox& a, const CellBox& b) {
  return unite(a, b).numVoxels() == a.numVoxels() + b.numVoxels();
}

/// Every voxel of the region that passes the filter lies in one cuboid of its class; no other voxel does.
void expectExact(const CuboidMap& map, const CellBox& region, CuboidFilter classes,
                 const std::vector<Cuboid>& joined) {
  std::map<Cell, Occupancy> covered;
  for (const Cuboid& cuboid : joined) {
    ASSERT_FALSE(cuboid.box.isEmpty());
    test::visitCells(cuboid.box, [&](const Cell& cell) {
      EXPECT_TRUE(covered.emplace(cell, cuboid.occupancy).second) << cell << " lies in two";
    });
  }
  std::size_t num_expected = 0;
  test::visitCells(intersect(region, kJoinedArea), [&](const Cell& cell) {
    const Occupancy occupancy = map.voxels().at(cell);
    if (occupancy == Occupancy::kUnknown || !matches(classes, {CellBox::ofCell(cell), occupancy})) {
      return;
    }
    ++num_expected;
    const auto found = covered.find(cell);
    ASSERT_TRUE(found != covered.end()) << cell;
    EXPECT_EQ(found->second, occupancy) << cell;
  });
  EXPECT_EQ(covered.size(), num_expected);
}

TEST(JoinedCuboids, coverExactlyTheVoxelsOfTheirClassInTheRegion) {
  Random random(3901);
  std::size_t num_cases = 0;
  for (; num_cases < 300; ++num_cases) {
    SCOPED_TRACE(test::seedNote(num_cases));
    const CuboidMap map = makeMap(randomUpdates(random));
    const bool is_part = random.chance(0.7);
    const CellBox region = is_part ? test::randomBoxInside(random, kJoinedArea) : kAllCells;
    const auto classes = static_cast<CuboidFilter>(random.integer(0, 2));
    const std::vector<Cuboid> joined = joinCuboids(map, region, classes, Budget::unlimited()).value;
    expectExact(map, region, classes, joined);
    for (std::size_t i = 0; i < joined.size(); ++i) {
      for (std::size_t k = 0; k < i; ++k) {
        const bool is_one = joined[i].occupancy == joined[k].occupancy &&
                            shareWholeFace(joined[i].box, joined[k].box);
        ASSERT_FALSE(is_one) << joined[i] << " and " << joined[k] << " could be one";
      }
    }
    if (HasFatalFailure()) return;
  }
  EXPECT_EQ(num_cases, 300U);
}

TEST(JoinedCuboids, areTheSameForEveryOrderOfCloudsAndFusion) {
  Random random(3902);
  for (std::size_t i = 0; i < 100; ++i) {
    // Thresholds so far apart that the order of observations does not change a class.
    MapConfig config;
    config.sensor_model.alpha_min = 0.0005;
    config.sensor_model.alpha_max = 0.9995;
    std::vector<ScanUpdate> updates = randomUpdates(random);
    updates.resize(std::min<std::size_t>(updates.size(), 6));
    const std::vector<Cuboid> joined =
        joinCuboids(makeMap(updates, config), kAllCells, CuboidFilter::kAll, Budget::unlimited())
            .value;
    for (const FusionKind fusion : {FusionKind::kClass, FusionKind::kGrowth, FusionKind::kNone}) {
      random.shuffle(updates);
      config.fusion = fusion;
      config.fuse = random.chance(0.5) ? FusionTime::kEveryCloud : FusionTime::kWhenRead;
      ASSERT_EQ(
          joinCuboids(makeMap(updates, config), kAllCells, CuboidFilter::kAll, Budget::unlimited())
              .value,
          joined)
          << test::seedNote(i);
    }
  }
}

TEST(JoinedCuboids, aWallIsOneCuboid) {
  CuboidMap map;
  const CellBox wall{{-37, 5, -20}, {91, 7, 33}};
  map.replace(kAllCells, std::vector<UniformBox>{{wall, 1.0F}});
  const std::vector<Cuboid> joined =
      joinCuboids(map, kAllCells, CuboidFilter::kAll, Budget::unlimited()).value;
  ASSERT_EQ(joined.size(), 1U);
  EXPECT_EQ(joined[0], (Cuboid{wall, Occupancy::kOccupied}));
}

TEST(JoinedCuboids, thereAreNoneInNothing) {
  CuboidMap map;
  EXPECT_TRUE(joinCuboids(map, kAllCells, CuboidFilter::kAll, Budget::unlimited()).isNotFound());
  map.replace(kAllCells, std::vector<UniformBox>{{{{0, 0, 0}, {8, 8, 8}}, 1.0F}});
  EXPECT_TRUE(joinCuboids(map, CellBox{}, CuboidFilter::kAll, Budget::unlimited()).isNotFound());
  EXPECT_TRUE(joinCuboids(map, {{5, 5, 5}, {1, 9, 9}}, CuboidFilter::kAll, Budget::unlimited())
                  .isNotFound());
  EXPECT_TRUE(joinCuboids(map, kAllCells, CuboidFilter::kFree, Budget::unlimited()).isNotFound());
}

TEST(JoinedCuboids, leaveOutWhatTheBudgetDoesNotReach) {
  CuboidMap map;
  map.replace(kAllCells, std::vector<UniformBox>{{{{0, 0, 0}, {80, 8, 8}}, 1.0F}});
  QueryLimits limits;
  limits.max_bricks = 14;  // Each of ten bricks costs one to collect, and one to divide.
  Budget budget(limits);
  const auto joined = joinCuboids(map, kAllCells, CuboidFilter::kAll, budget);
  EXPECT_EQ(joined.status, AnswerStatus::kBudgetSpent);
  ASSERT_EQ(joined.value.size(), 1U);
  EXPECT_EQ(joined.value[0].box.max.x, 32);
}

TEST(JoinedCuboids, letOthersHaveTheirTurnAndEndSoonWhileTheyAreJoined) {
  CuboidMap map;
  const CellBox area{{0, 0, 0}, {160, 160, 160}};
  map.replace(area, {{{area, -1.0F}}});
  std::atomic<bool> is_stopped{false};
  int num_turns = 0;
  const auto yield = [&] { is_stopped = ++num_turns == 20; };
  Budget budget(QueryLimits{}, {yield, 0.0, &is_stopped});
  const auto joined = joinCuboids(map, kAllCells, CuboidFilter::kAll, budget);
  EXPECT_EQ(joined.status, AnswerStatus::kBudgetSpent);
  EXPECT_EQ(num_turns, 20);
  EXPECT_GT(joined.value.size(), 1U);
  EXPECT_LT(joined.value.size(), 8000U);
  double num_voxels = 0.0;
  for (const Cuboid& cuboid : joined.value) num_voxels += cuboid.box.numVoxels();
  EXPECT_EQ(num_voxels, area.numVoxels());
}

}  // namespace
}  // namespace cuboid_mapping
