// SPDX-License-Identifier: BSD-3-Clause
// The cuboids depend on what was seen, not on the order in which it came.
#include "cuboid_mapping/map/cuboid_map.h"
#include "support/snapshots.h"
#include "support/update_source.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace cuboid_mapping {
namespace {

using test::Random;
using test::UpdateSource;

MapConfig configWith(FusionKind fusion, const RTreeConfig& rtree) {
  MapConfig config;
  config.resolution_m = 0.1;
  config.fusion = fusion;
  config.rtree = rtree;
  return config;
}

/// The cuboids of a map after some updates.
std::vector<Cuboid> cuboidsAfter(const MapConfig& config, const std::vector<ScanUpdate>& updates) {
  CuboidMap map(config);
  for (const ScanUpdate& update : updates) map.apply(update);
  return test::allCuboids(map);
}

TEST(CuboidMapCanonical, isTheSameWhateverTheOrderOfTheClouds) {
  Random random(8);
  constexpr std::size_t kCases = 60;
  std::size_t num_cuboids = 0;
  for (std::size_t i = 0; i < kCases; ++i) {
    MapConfig config = configWith(FusionKind::kClass, {4, 2});
    config.sensor_model.alpha_min = 0.001;  // Six clouds do not reach the thresholds.
    config.sensor_model.alpha_max = 0.999;
    UpdateSource source(random);
    std::vector<ScanUpdate> updates;
    updates.reserve(6);
    for (int u = 0; u < 6; ++u) updates.push_back(source.next());
    const std::vector<Cuboid> expected = cuboidsAfter(config, updates);
    random.shuffle(updates);
    ASSERT_EQ(cuboidsAfter(config, updates), expected) << test::seedNote(i);
    num_cuboids += expected.size();
  }
  EXPECT_GT(num_cuboids, 20 * kCases);
}

// Cells of neighbouring bricks compete for voxels: with growth, the order of trial counts.
TEST(CuboidMapCanonical, isTheSameWhateverTheOrderOfTheBricksOfACloud) {
  MapConfig config;
  config.fusion = FusionKind::kGrowth;
  Random random(33);
  for (int i = 0; i < 10; ++i) {
    ScanUpdate update;
    forEachBrick({{-16, -16, -16}, {16, 16, 16}}, [&](const Cell& cell) {
      BrickUpdate brick;
      brick.brick = cell;
      for (int box = 0; box < 3; ++box) {
        test::markBox(brick.misses, test::randomBoxInside(random, brickBox(cell)));
      }
      brick.hits = ~brick.misses;
      update.bricks.push_back(brick);
    });
    ScanUpdate shuffled = update;
    random.shuffle(shuffled.bricks);
    CuboidMap map(config);
    CuboidMap other(config);
    for (int cloud = 0; cloud < 6; ++cloud) {  // Until all voxels are stable.
      map.apply(update);
      other.apply(shuffled);
    }
    ASSERT_EQ(test::allCuboids(other), test::allCuboids(map)) << test::seedNote(i);
    EXPECT_LT(countCuboids(map).total(), 32U * 32U * 32U / 4);
  }
}

TEST(CuboidMapCanonical, isTheSameWhenACloudIsDividedByBricks) {
  Random random(9);
  UpdateSource source(random);
  for (std::size_t i = 0; i < 100; ++i) {
    const MapConfig config = configWith(FusionKind::kClass, {8, 3});
    const ScanUpdate first = source.next();
    const ScanUpdate second = source.next();
    std::vector<ScanUpdate> divided{first};
    for (const BrickUpdate& brick : second.bricks) {
      divided.emplace_back();
      divided.back().bricks.push_back(brick);
    }
    ASSERT_EQ(cuboidsAfter(config, divided), cuboidsAfter(config, {first, second}))
        << test::seedNote(i);
  }
}

TEST(CuboidMapCanonical, isTheSameForEveryOrderOfTheTree) {
  Random random(10);
  UpdateSource source(random);
  std::vector<ScanUpdate> updates;
  updates.reserve(60);
  for (int i = 0; i < 60; ++i) updates.push_back(source.next());
  for (const FusionKind fusion : {FusionKind::kClass, FusionKind::kGrowth, FusionKind::kNone}) {
    const auto expected = cuboidsAfter(configWith(fusion, {32, 12}), updates);
    ASSERT_GT(expected.size(), 100U);
    for (const RTreeConfig& order : {RTreeConfig{4, 2}, RTreeConfig{5, 2}, RTreeConfig{8, 3},
                                     RTreeConfig{16, 6}, RTreeConfig{64, 8}, RTreeConfig{64, 32}}) {
      EXPECT_EQ(cuboidsAfter(configWith(fusion, order), updates), expected)
          << toString(fusion) << ", M = " << order.max_branches;
    }
  }
}

}  // namespace
}  // namespace cuboid_mapping
