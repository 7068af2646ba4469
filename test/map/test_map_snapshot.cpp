// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/map_snapshot.h"

#include "support/snapshots.h"

#include <gtest/gtest.h>

#include <limits>

namespace cuboid_mapping {
namespace {

using test::Random;

MapConfig configOf(const MapSnapshot& snapshot) {
  MapConfig config;
  config.resolution_m = snapshot.resolution_m;
  config.sensor_model = snapshot.sensor_model;
  return config;
}

TEST(MapSnapshot, bringsAMapBack) {
  Random random(51);
  for (int i = 0; i < 15; ++i) {
    MapSnapshot snapshot = test::randomSnapshot(random);
    MapConfig config = configOf(snapshot);
    config.hot_bytes = i % 2 == 0 ? 0 : std::size_t{1} << 30;
    CuboidMap map(config);
    map.apply(test::randomUpdate(random, {{-3, -3, -3}, {3, 3, 3}}, 9));
    const auto revision = map.revision();
    const ChangeSet changes = restoreSnapshot(snapshot, map);
    EXPECT_TRUE(changes.is_everything);
    EXPECT_GT(map.revision(), revision);
    EXPECT_EQ(changes.revision, map.revision());
    ASSERT_EQ(test::voxelsOf(takeSnapshot(map, "").cuboids), test::voxelsOf(snapshot.cuboids))
        << test::seedNote(i);
    ASSERT_TRUE(checkTree(map.tree()).empty());
    ASSERT_TRUE(checkDisjoint(map.tree()).empty());
    // It is fused as if it had been filled by clouds.
    const MapSnapshot restored = takeSnapshot(map, "odom");
    CuboidMap again(config);
    restoreSnapshot(restored, again);
    EXPECT_EQ(test::allCuboids(again.tree()), test::allCuboids(map.tree()));
    // And goes on as the first one would have gone on.
    const ScanUpdate update = test::randomUpdate(random, {{-2, -2, -2}, {2, 2, 2}}, 9);
    map.apply(update);
    again.apply(update);
    map.flush();
    again.flush();
    EXPECT_EQ(test::allCuboids(again.tree()), test::allCuboids(map.tree()));
  }
}

TEST(MapSnapshot, comesBackClampedAndInBricks) {
  MapSnapshot snapshot;
  snapshot.cuboids = {{{{-8, 0, 0}, {24, 8, 8}}, 100.0F}, {{{0, 8, 0}, {8, 16, 8}}, -100.0F}};
  CuboidMap map(configOf(snapshot));
  restoreSnapshot(snapshot, map);
  EXPECT_EQ(map.tree().size(), 5U);
  EXPECT_EQ(map.content().occupied_voxels, 4 * 512.0);
  for (const Cuboid& cuboid : test::allCuboids(map.tree())) {
    EXPECT_TRUE(map.sensorModel().isStable(cuboid.log_odds));
    EXPECT_LT(std::abs(cuboid.log_odds), 8.0F);
  }
}

/// What is wrong with a snapshot that holds this.
std::string faultOf(const std::vector<Cuboid>& cuboids, const SnapshotLimits& limits = {}) {
  MapSnapshot snapshot;
  snapshot.cuboids = cuboids;
  const auto fault = findFault(snapshot, limits);
  return fault ? fault->text : "";
}

TEST(MapSnapshot, isCheckedForWhatCannotBe) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const CellBox box{{0, 0, 0}, {8, 8, 8}};
  EXPECT_EQ(faultOf({}), "");
  EXPECT_EQ(faultOf({{box, 1.0F}, {{{8, 0, 0}, {9, 1, 1}}, 1.0F}}), "");
  EXPECT_NE(faultOf({{{{0, 0, 0}, {0, 1, 1}}, 1.0F}}).find("empty"), std::string::npos);
  EXPECT_NE(faultOf({{{{0, 0, 0}, {Grid::kMaxCell + 1, 1, 1}}, 1.0F}}).find("beyond"),
            std::string::npos);
  EXPECT_NE(faultOf({{box, kNan}}).find("log-odds"), std::string::npos);
  EXPECT_NE(faultOf({{box, 1.0F}, {{{7, 7, 7}, {9, 9, 9}}, 1.0F}}).find("shares"),
            std::string::npos);
  EXPECT_NE(faultOf({{kAllCells, 1.0F}}).find("bricks"), std::string::npos);
  EXPECT_NE(faultOf({{box, 1.0F}, {CellBox::ofCell({8, 0, 0}), 1.0F}}, {1}).find("bricks"),
            std::string::npos);
  for (const double resolution_m : {0.0, -1.0, 1e3, std::numeric_limits<double>::quiet_NaN()}) {
    MapSnapshot snapshot;
    snapshot.resolution_m = resolution_m;
    EXPECT_TRUE(findFault(snapshot)) << resolution_m;
  }
  MapSnapshot snapshot;
  snapshot.sensor_model.hit = 0.5;
  EXPECT_TRUE(findFault(snapshot));
}

}  // namespace
}  // namespace cuboid_mapping
