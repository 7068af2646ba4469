// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/cuboid_map.h"

#include "cuboid_mapping/fusion/cuboid_tree.h"
#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/scan/scan_update.h"
#include "support/following_copy.h"
#include "support/modelled_map.h"
#include "support/snapshots.h"
#include "support/update_source.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

namespace cuboid_mapping {
namespace {

using test::FollowingCopy;
using test::ModelledMap;
using test::Random;
using test::UpdateSource;

MapConfig configOf(Environment environment, FusionKind fusion, const RTreeConfig& rtree = {}) {
  MapConfig config;
  config.resolution_m = 0.1;
  config.environment = environment;
  config.fusion = fusion;
  config.rtree = rtree;
  return config;
}

/// An update of one brick at the origin.
ScanUpdate updateOf(const std::vector<CellBox>& hits, const std::vector<CellBox>& misses) {
  BrickUpdate brick;
  for (const CellBox& box : hits) test::markBox(brick.hits, box);
  for (const CellBox& box : misses) test::markBox(brick.misses, box);
  ScanUpdate update;
  update.bricks.push_back(brick);
  return update;
}

const CellBox kBrick = brickBox({0, 0, 0});

TEST(CuboidMap, isEmptyAtFirst) {
  const CuboidMap map;
  EXPECT_TRUE(test::allCuboids(map).empty());
  EXPECT_FALSE(map.bounds().has_value());
  EXPECT_EQ(map.revision(), 0U);
  EXPECT_EQ(map.config().fusion, FusionKind::kClass);
  EXPECT_EQ(map.sensorModel().environment(), Environment::kDynamic);
}

TEST(CuboidMap, grazesFreeWhatIsUnknownAndNothingElse) {
  CuboidMap map(configOf(Environment::kDynamic, FusionKind::kClass));
  const Cell hit{1, 1, 1};
  const Cell free{2, 1, 1};
  const Cell unknown{3, 1, 1};
  map.apply(updateOf({CellBox::ofCell(hit)}, {CellBox::ofCell(free)}));
  ScanUpdate grazing = updateOf({}, {});
  for (const Cell& cell : {hit, free, unknown}) grazing.bricks[0].grazes.set(voxelIndex(cell));
  EXPECT_EQ(map.apply(grazing).revision, 2U);
  const auto value = [&map](const Cell& cell) { return map.voxels().logOddsAt(cell).value(); };
  EXPECT_EQ(value(hit), map.sensorModel().hit());
  EXPECT_EQ(value(free), map.sensorModel().miss());
  EXPECT_EQ(value(unknown), map.sensorModel().miss());
  EXPECT_EQ(map.apply(grazing).revision, 2U) << "all are known: nothing changes";
}

TEST(CuboidMap, hasTheConfigItIsGiven) {
  MapConfig config = configOf(Environment::kStatic, FusionKind::kNone, {8, 3});
  config.sensor_model.hit = 0.9;
  const CuboidMap map(config);
  EXPECT_EQ(map.grid().resolution(), 0.1);
  EXPECT_EQ(map.sensorModel().environment(), Environment::kStatic);
  EXPECT_NEAR(toProbability(map.sensorModel().hit()), 0.9, 1e-6);
  EXPECT_EQ(map.cuboids().inner().config().max_branches, 8);
  EXPECT_EQ(map.cuboids().inner().config().min_branches, 3);
}

TEST(CuboidMap, fusesABrickSeenAtOnceIntoOneCuboid) {
  CuboidMap map(configOf(Environment::kDynamic, FusionKind::kClass));
  map.apply(updateOf({}, {kBrick}));
  EXPECT_EQ(test::allCuboids(map), (std::vector<Cuboid>{{kBrick, Occupancy::kFree}}));
  EXPECT_EQ(map.voxels().logOddsAt({3, 4, 5}), map.sensorModel().miss());
}

TEST(CuboidMap, letsAHitWinOverAMissOfTheSameUpdate) {
  CuboidMap map(configOf(Environment::kDynamic, FusionKind::kClass));
  map.apply(updateOf({kBrick}, {kBrick}));
  EXPECT_EQ(test::allCuboids(map), (std::vector<Cuboid>{{kBrick, Occupancy::kOccupied}}));
  EXPECT_EQ(map.voxels().logOddsAt({3, 4, 5}), map.sensorModel().hit());
}

TEST(CuboidMap, keepsACuboidWholeWhileItsVoxelsDifferInLogOddsOnly) {
  CuboidMap map(configOf(Environment::kDynamic, FusionKind::kClass));
  for (int i = 0; i < 10; ++i) map.apply(updateOf({}, {kBrick}));
  const CellBox voxel = CellBox::ofCell({3, 4, 5});
  const ChangeSet changes = map.apply(updateOf({voxel}, {}));
  ASSERT_EQ(changes.bricks.size(), 1U);
  EXPECT_FALSE(changes.bricks[0].has_new_cuboids);
  EXPECT_EQ(test::allCuboids(map), (std::vector<Cuboid>{{kBrick, Occupancy::kFree}}));
  const SensorModel& model = map.sensorModel();
  EXPECT_EQ(map.voxels().logOddsAt({3, 4, 5}), model.update(model.min(), model.hit()));
  EXPECT_EQ(map.voxels().logOddsAt({4, 4, 5}), model.min());
}

TEST(CuboidMap, splitsAStableCuboidThatIsContradictedWhenDynamic) {
  CuboidMap map(configOf(Environment::kDynamic, FusionKind::kClass));
  for (int i = 0; i < 10; ++i) map.apply(updateOf({}, {kBrick}));
  ASSERT_EQ(test::allCuboids(map), (std::vector<Cuboid>{{kBrick, Occupancy::kFree}}));

  const CellBox voxel = CellBox::ofCell({3, 4, 5});
  for (int i = 0; i < 10; ++i) map.apply(updateOf({voxel}, {}));
  const std::vector<Cuboid> cuboids = test::allCuboids(map);
  EXPECT_EQ(std::count(cuboids.begin(), cuboids.end(), Cuboid{voxel, Occupancy::kOccupied}), 1);
  EXPECT_LE(cuboids.size(), 8U) << "the voxel and few pieces around it";
  EXPECT_EQ(checkMap(map), std::vector<std::string>{});

  for (int i = 0; i < 20; ++i) map.apply(updateOf({}, {voxel}));
  EXPECT_EQ(test::allCuboids(map), (std::vector<Cuboid>{{kBrick, Occupancy::kFree}}))
      << "fused again";
}

TEST(CuboidMap, leavesAStableCuboidAloneWhenStatic) {
  CuboidMap map(configOf(Environment::kStatic, FusionKind::kClass));
  for (int i = 0; i < 10; ++i) map.apply(updateOf({}, {kBrick}));
  const std::uint64_t revision = map.revision();
  const ChangeSet changes = map.apply(updateOf({CellBox::ofCell({3, 4, 5})}, {}));
  EXPECT_TRUE(changes.bricks.empty());
  EXPECT_EQ(map.revision(), revision);
  EXPECT_EQ(test::allCuboids(map), (std::vector<Cuboid>{{kBrick, Occupancy::kFree}}));
  EXPECT_EQ(map.voxels().logOddsAt({3, 4, 5}), map.sensorModel().min());
}

TEST(CuboidMap, doesNotChangeWhenEverythingIsClampedAlready) {
  CuboidMap map(configOf(Environment::kDynamic, FusionKind::kClass));
  for (int i = 0; i < 10; ++i) map.apply(updateOf({CellBox::ofCell({1, 1, 1})}, {kBrick}));
  const std::uint64_t revision = map.revision();
  for (int i = 0; i < 3; ++i) {
    const ChangeSet changes = map.apply(updateOf({CellBox::ofCell({1, 1, 1})}, {kBrick}));
    EXPECT_TRUE(changes.bricks.empty());
    EXPECT_FALSE(changes.is_everything);
    EXPECT_EQ(changes.revision, revision);
    EXPECT_EQ(map.revision(), revision);
  }
}

TEST(CuboidMap, doesNotChangeByAnEmptyUpdate) {
  CuboidMap map;
  const ChangeSet changes = map.apply(ScanUpdate{});
  EXPECT_TRUE(changes.bricks.empty());
  EXPECT_FALSE(changes.is_everything);
  EXPECT_EQ(map.revision(), 0U);
}

TEST(CuboidMap, countsABrickOnceThatComesTwiceInAnUpdate) {
  ScanUpdate twice;
  const BrickMask left = BrickMask::ofBox({{0, 0, 0}, {4, 8, 8}});
  const BrickMask all = BrickMask::all();
  twice.bricks.push_back({{8, 0, 0}, {}, left});
  twice.bricks.push_back({{0, 0, 0}, {}, all});
  twice.bricks.push_back({{8, 0, 0}, left, all});
  CuboidMap map;
  const ChangeSet changes = map.apply(twice);
  EXPECT_EQ(changes.bricks.size(), 2U);
  EXPECT_EQ(map.voxels().numFreeVoxels(), 512.0 + 256.0);
  EXPECT_EQ(map.voxels().numOccupiedVoxels(), 256.0);
  EXPECT_EQ(checkMap(map), std::vector<std::string>{});
}

/// Scans of two sensors that look at each other, along the diagonal.
std::array<Scan, 2> scansOfTwoSensors(Random& random) {
  std::array<Scan, 2> scans;
  scans[0].origin = Eigen::Vector3f::Constant(9.65F);
  scans[1].origin = Eigen::Vector3f::Constant(2.5F);
  for (Scan& scan : scans) {
    for (int i = 0; i < 40; ++i) {
      const auto place = [&random] { return static_cast<float>(random.real(2.5, 9.6)); };
      scan.points.emplace_back(place(), place(), place());
    }
  }
  return scans;
}

TEST(CuboidMap, isThatOfBothScansForTwoUpdatesUnitedOrInARow) {
  Random random(7);
  for (const FusionKind fusion : {FusionKind::kClass, FusionKind::kGrowth}) {
    const MapConfig config = configOf(Environment::kDynamic, fusion);
    const std::array<Scan, 2> scans = scansOfTwoSensors(random);
    CuboidMap expected(config);
    expected.apply(ScanUpdater(Grid(0.1)).compute(scans.data(), scans.size()));
    const ScanUpdate first = ScanUpdater(Grid(0.1)).compute(scans[0]);
    const ScanUpdate second = ScanUpdater(Grid(0.1)).compute(scans[1]);
    ScanUpdate in_a_row = first;
    in_a_row.bricks.insert(in_a_row.bricks.end(), second.bricks.begin(), second.bricks.end());
    for (const ScanUpdate& both : {in_a_row, unite(first, second), unite(second, first)}) {
      CuboidMap map(config);
      map.apply(both);
      EXPECT_EQ(checkMap(map), std::vector<std::string>{});
      EXPECT_TRUE(test::voxelsOf(map) == test::voxelsOf(expected));
      EXPECT_EQ(map.voxels().numFreeVoxels(), expected.voxels().numFreeVoxels());
      EXPECT_EQ(map.voxels().numOccupiedVoxels(), expected.voxels().numOccupiedVoxels());
    }
  }
}

TEST(CuboidMap, forgetsEverythingWhenCleared) {
  CuboidMap map(configOf(Environment::kDynamic, FusionKind::kClass));
  map.apply(updateOf({}, {kBrick}));
  const std::uint64_t revision = map.revision();
  const ChangeSet changes = map.clear();
  EXPECT_TRUE((countCuboids(map).total() == 0));
  EXPECT_EQ(countCuboids(map).free, 0U);
  EXPECT_EQ(map.voxels().numFreeVoxels(), 0.0);
  EXPECT_FALSE(map.bounds().has_value());
  EXPECT_TRUE(changes.is_everything);
  EXPECT_GT(map.revision(), revision);
  EXPECT_EQ(changes.revision, map.revision());
  map.apply(updateOf({}, {kBrick}));
  EXPECT_EQ(test::allCuboids(map), (std::vector<Cuboid>{{kBrick, Occupancy::kFree}}));
}

/// Whether a voxel of the brick has changed in value, or in class.
bool hasChanged(const ChangedBrick& changed, const test::VoxelMap& before,
                const test::VoxelMap& after) {
  bool has_changed = false;
  test::visitCells(brickBox(changed.brick), [&](const Cell& cell) {
    const bool is_other = changed.has_new_cuboids
                              ? before.occupancyAt(cell) != after.occupancyAt(cell)
                              : before.find(cell) != after.find(cell);
    has_changed = has_changed || is_other;
  });
  return has_changed;
}

/// Bricks with a changed voxel.
std::set<Cell> changedBricks(const test::VoxelMap& before, const test::VoxelMap& after) {
  std::set<Cell> bricks;
  for (const auto& [cell, log_odds] : after.voxels()) {
    if (before.find(cell) != log_odds) bricks.insert(brickOf(cell));
  }
  for (const auto& [cell, log_odds] : before.voxels()) {
    if (!after.find(cell)) bricks.insert(brickOf(cell));
  }
  return bricks;
}

/// Whether the map counts its cuboids correctly.
testing::AssertionResult hasRightCounts(const CuboidMap& map) {
  CuboidCounts expected;
  for (const Cuboid& cuboid : test::allCuboids(map)) {
    ++(cuboid.isOccupied() ? expected.occupied : expected.free);
  }
  const CuboidCounts counts = countCuboids(map);
  if (counts.free == expected.free && counts.occupied == expected.occupied) {
    return testing::AssertionSuccess();
  }
  return testing::AssertionFailure()
         << counts.free << " free cuboids instead of " << expected.free << ", " << counts.occupied
         << " occupied ones instead of " << expected.occupied;
}

using MapParam = std::tuple<Environment, FusionKind, RTreeConfig>;
class CuboidMapModel : public testing::TestWithParam<MapParam> {
 protected:
  [[nodiscard]] MapConfig config() const {
    return configOf(std::get<0>(GetParam()), std::get<1>(GetParam()), std::get<2>(GetParam()));
  }
};

TEST_P(CuboidMapModel, isVoxelByVoxelTheReferenceAndToldByItsChangeSets) {
  Random random(7);
  UpdateSource source(random);
  ModelledMap model(config());
  FollowingCopy copy;
  ScanUpdate update;
  constexpr std::size_t kUpdates = 100;
  std::size_t num_without_change = 0;
  std::size_t greatest_size = 0;
  for (std::size_t i = 0; i < kUpdates; ++i) {
    const std::uint64_t revision = model.map.revision();
    if (i % 50 == 40) {
      const ChangeSet changes = model.map.clear();
      ASSERT_TRUE(changes.is_everything);
      model.voxels.clear();
      copy.follow(model.map, changes);
      ASSERT_EQ(changes.revision, model.map.revision());
      ASSERT_GT(model.map.revision(), revision);
      continue;
    }
    if (i % 20 <= 12) update = source.next();  // Else the same, until all voxels are clamped.
    const test::VoxelMap before = model.voxels;
    const std::size_t num_changed = model.voxels.apply(update);
    const ChangeSet changes = model.map.apply(update);
    copy.follow(model.map, changes);

    num_without_change += num_changed == 0 ? 1 : 0;
    greatest_size = std::max(greatest_size, copy.size());
    ASSERT_TRUE(hasVoxels(model.map, model.voxels)) << test::seedNote(i);
    ASSERT_EQ(checkMap(model.map), std::vector<std::string>{}) << test::seedNote(i);
    ASSERT_EQ(copy.cuboids(), test::allCuboids(model.map)) << test::seedNote(i);
    ASSERT_TRUE(hasRightCounts(model.map)) << test::seedNote(i);
    ASSERT_EQ(changes.revision, model.map.revision());
    ASSERT_EQ(model.map.revision() > revision, num_changed > 0) << test::seedNote(i);
    // With growth, cuboids fuse after their voxels change.
    std::set<Cell> told;
    for (const ChangedBrick& changed : changes.bricks) {
      told.insert(changed.brick);
      ASSERT_TRUE(hasChanged(changed, before, model.voxels) ||
                  model.map.config().fusion == FusionKind::kGrowth)
          << changed.brick << test::seedNote(i);
    }
    const std::set<Cell> expected = changedBricks(before, model.voxels);
    ASSERT_TRUE(std::includes(told.begin(), told.end(), expected.begin(), expected.end()))
        << test::seedNote(i);
    if (i % 3 != 2) continue;  // The bricks wait for up to a few clouds.
    const std::vector<Cuboid> unfused = test::allCuboids(model.map);
    ASSERT_EQ(test::allCuboids(model.map), unfused) << test::seedNote(i);
  }
  EXPECT_GT(greatest_size, 100U);
  EXPECT_GE(num_without_change, 5U);
}

std::string nameOf(const testing::TestParamInfo<MapParam>& info) {
  const auto& [environment, fusion, order] = info.param;
  return toString(fusion) +
         std::string(environment == Environment::kStatic ? "Static" : "Dynamic") +
         std::to_string(order.min_branches) + "of" + std::to_string(order.max_branches);
}

INSTANTIATE_TEST_SUITE_P(
    AllConfigs, CuboidMapModel,
    testing::Combine(testing::Values(Environment::kDynamic, Environment::kStatic),
                     testing::Values(FusionKind::kClass, FusionKind::kGrowth, FusionKind::kNone),
                     testing::Values(RTreeConfig{4, 2}, RTreeConfig{5, 2}, RTreeConfig{32, 12})),
    nameOf);

}  // namespace
}  // namespace cuboid_mapping
