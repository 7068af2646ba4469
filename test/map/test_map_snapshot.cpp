// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/map_snapshot.h"

#include "support/snapshots.h"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

namespace cuboid_mapping {
namespace {

using test::Random;

MapConfig configFor(const MapSnapshot& snapshot) {
  MapConfig config;
  config.resolution_m = snapshot.resolution_m;
  config.sensor_model = snapshot.sensor_model;
  return config;
}

TEST(MapSnapshot, bringsAMapBack) {
  Random random(51);
  for (int i = 0; i < 15; ++i) {
    MapSnapshot snapshot = test::randomSnapshot(random);
    MapConfig config = configFor(snapshot);
    config.fusion = i % 2 == 0 ? FusionKind::kClass : FusionKind::kGrowth;
    CuboidMap map(config);
    map.apply(test::randomUpdate(random, {{-3, -3, -3}, {3, 3, 3}}, 9));
    const auto revision = map.revision();
    const ChangeSet changes = restoreSnapshot(snapshot, map);
    EXPECT_TRUE(changes.is_everything);
    EXPECT_GT(map.revision(), revision);
    EXPECT_EQ(changes.revision, map.revision());
    ASSERT_EQ(test::voxelsOf(takeSnapshot(map, "").bricks), test::voxelsOf(snapshot.bricks))
        << test::seedNote(i);
    ASSERT_EQ(checkMap(map), std::vector<std::string>{}) << test::seedNote(i);
    // It is fused as if clouds had filled it.
    const MapSnapshot restored = takeSnapshot(map, "odom");
    CuboidMap again(config);
    restoreSnapshot(restored, again);
    EXPECT_EQ(test::allCuboids(again), test::allCuboids(map));
    // Later clouds change both maps alike.
    const ScanUpdate update = test::randomUpdate(random, {{-2, -2, -2}, {2, 2, 2}}, 9);
    map.apply(update);
    again.apply(update);
    EXPECT_EQ(test::allCuboids(again), test::allCuboids(map));
  }
}

TEST(MapSnapshot, ACopyIsTheMap) {
  Random random(57);
  for (const FusionKind fusion : {FusionKind::kClass, FusionKind::kGrowth, FusionKind::kNone}) {
    MapConfig config;
    config.fusion = fusion;
    CuboidMap map(config);
    for (int i = 0; i < 5; ++i) map.apply(test::randomUpdate(random, {{-3, -3, -3}, {3, 3, 3}}, 9));
    map.lock({{0, 0, 0}, {9, 9, 9}});
    CuboidMap copy = copyOf(map);
    EXPECT_EQ(test::allCuboids(copy), test::allCuboids(map));
    EXPECT_EQ(test::voxelsOf(takeSnapshot(copy, "").bricks),
              test::voxelsOf(takeSnapshot(map, "").bricks));
    EXPECT_EQ(copy.lockedBoxes(), map.lockedBoxes());
    copy.clear();
    EXPECT_GT(map.voxels().size(), 0U);
  }
}

TEST(MapSnapshot, OfAnotherResolutionIsRefused) {
  Random random(52);
  const MapSnapshot snapshot = test::randomSnapshot(random);
  MapConfig config;
  config.resolution_m = 2.0 * snapshot.resolution_m;
  CuboidMap map(config);
  EXPECT_THROW(restoreSnapshot(snapshot, map), std::invalid_argument);
  EXPECT_EQ(map.revision(), 0U);
}

TEST(MapSnapshot, comesBackExactlyAlsoBeyondTheThresholds) {
  MapSnapshot snapshot;
  snapshot.bricks = {{{-8, 0, 0}, PackedVoxels(BrickMask::all(), 100.0F)},
                     {{0, 8, 0}, PackedVoxels(BrickMask::all(), -100.0F)}};
  CuboidMap map(configFor(snapshot));
  restoreSnapshot(snapshot, map);
  EXPECT_EQ(countCuboids(map).total(), 2U);
  EXPECT_EQ(map.voxels().numOccupiedVoxels(), 512.0);
  EXPECT_EQ(map.voxels().logOddsAt({-1, 0, 0}), 100.0F);
  EXPECT_EQ(map.voxels().logOddsAt({0, 8, 0}), -100.0F);
}

TEST(MapSnapshot, holdsTheBricksOnceAndAlongTheMortonCurve) {
  Random random(52);
  const MapSnapshot snapshot = test::randomSnapshot(random);
  ASSERT_GT(snapshot.bricks.size(), 20U);
  EXPECT_FALSE(findFault(snapshot)) << findFault(snapshot)->text;
}

/// Defect of a snapshot with these bricks.
std::string faultOf(const std::vector<VoxelBrick>& bricks, const SnapshotLimits& limits = {}) {
  MapSnapshot snapshot;
  snapshot.bricks = bricks;
  const auto fault = findFault(snapshot, limits);
  return fault ? fault->text : "";
}

VoxelBrick brickAt(const Cell& brick, float log_odds = 1.0F) {
  return {brick, PackedVoxels(BrickMask::all(), log_odds)};
}

testing::AssertionResult contains(const std::string& text, const std::string& part) {
  if (text.find(part) != std::string::npos) return testing::AssertionSuccess();
  return testing::AssertionFailure() << '"' << text << '"';
}

TEST(MapSnapshot, isCheckedForWhatCannotBe) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  EXPECT_EQ(faultOf({}), "");
  EXPECT_EQ(faultOf({brickAt({0, 0, 0}), brickAt({8, 0, 0})}), "");
  EXPECT_TRUE(contains(faultOf({{{0, 0, 0}, PackedVoxels()}}), "no voxels"));
  EXPECT_TRUE(contains(faultOf({brickAt({1, 0, 0})}), "multiples of 8"));
  EXPECT_TRUE(contains(faultOf({brickAt({Grid::kMaxCell, 0, 0})}), "beyond"));
  EXPECT_TRUE(contains(faultOf({brickAt({0, 0, 0}, kInfinity)}), "log-odds"));
  EXPECT_TRUE(contains(faultOf({brickAt({0, 0, 0}, -kInfinity)}), "log-odds"));
  EXPECT_TRUE(contains(faultOf({brickAt({0, 0, 0}), brickAt({0, 0, 0})}), "twice"));
  EXPECT_TRUE(contains(faultOf({brickAt({8, 0, 0}), brickAt({0, 0, 0})}), "order"));
  EXPECT_TRUE(contains(faultOf({brickAt({0, 0, 0}), brickAt({8, 0, 0})}, {1}), "bricks"));
  for (const double resolution_m : {0.0, -1.0, 1e3, std::numeric_limits<double>::quiet_NaN()}) {
    MapSnapshot snapshot;
    snapshot.resolution_m = resolution_m;
    EXPECT_TRUE(findFault(snapshot)) << resolution_m;
  }
  MapSnapshot snapshot;
  snapshot.sensor_model.hit = 0.5;
  EXPECT_TRUE(findFault(snapshot));
}

TEST(RestoreSnapshot, keepsGrownCuboidsThatFitTheVoxels) {
  MapConfig config;
  config.fusion = FusionKind::kGrowth;
  Random random(63);
  CuboidMap map(config);
  for (int i = 0; i < 30; ++i) map.apply(test::randomUpdate(random, {{-2, -2, -2}, {2, 2, 2}}, 40));
  MapSnapshot snapshot = takeSnapshot(map, "map");
  CuboidMap copy(config);
  restoreSnapshot(snapshot, copy);
  EXPECT_EQ(test::allCuboids(copy), test::allCuboids(map));
  EXPECT_EQ(checkMap(copy), std::vector<std::string>{});

  for (Cuboid& cuboid : snapshot.cuboids) {  // None fits any more.
    cuboid.occupancy = cuboid.isOccupied() ? Occupancy::kFree : Occupancy::kOccupied;
  }
  restoreSnapshot(snapshot, copy);
  EXPECT_EQ(checkMap(copy), std::vector<std::string>{});
  EXPECT_EQ(static_cast<double>(countCuboids(copy).total()),
            map.voxels().numFreeVoxels() + map.voxels().numOccupiedVoxels());
}

}  // namespace
}  // namespace cuboid_mapping
