// SPDX-License-Identifier: BSD-3-Clause
// A map, and the expected state of each voxel.
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "support/map_cuboids.h"
#include "support/map_invariants.h"
#include "support/random_bricks.h"
#include "support/voxel_map.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace cuboid_mapping::test {

/// Whether every voxel of the reference has its log-odds, in one cuboid of its class, and no other voxel is known.
inline testing::AssertionResult hasVoxels(const CuboidMap& map, const VoxelMap& voxels) {
  std::size_t num_voxels = 0;
  for (const Cuboid& cuboid : allCuboids(map)) {
    bool is_right = true;
    visitCells(cuboid.box, [&](const Cell& cell) {
      const auto expected = voxels.find(cell);
      is_right = is_right && expected && classify(*expected) == cuboid.occupancy;
      ++num_voxels;
    });
    if (!is_right) return testing::AssertionFailure() << cuboid << " has a wrong voxel";
  }
  if (num_voxels != voxels.voxels().size()) {
    return testing::AssertionFailure()
           << num_voxels << " voxels instead of " << voxels.voxels().size();
  }
  for (const auto& [cell, log_odds] : voxels.voxels()) {
    if (map.voxels().logOddsAt(cell) != log_odds) {
      return testing::AssertionFailure() << "wrong log-odds of " << cell;
    }
  }
  return testing::AssertionSuccess();
}

/// A map and its reference, changed together.
struct ModelledMap {
  explicit ModelledMap(const MapConfig& config) : map(config), voxels(map.sensorModel()) {}

  void apply(const ScanUpdate& update) {
    map.apply(update);
    voxels.apply(update);
  }

  CuboidMap map;
  VoxelMap voxels;
};

/// A map of random clouds and random updates that no cloud would give, about 32 voxels wide.
///
/// @param offset  Shifts the map; in voxels, a multiple of 8.
inline ModelledMap randomMap(Random& random, const MapConfig& config, const Cell& offset = {}) {
  ModelledMap result(config);
  ScanUpdater updater(result.map.grid());
  ScanShape shape;
  shape.half_edge_m = 14.0 * config.resolution_m;
  shape.resolution_m = config.resolution_m;
  const auto apply = [&](ScanUpdate update) {
    for (BrickUpdate& brick : update.bricks) brick.brick = brick.brick + offset;
    result.apply(update);
  };
  for (int i = 0; i < 4; ++i) apply(updater.compute(randomScan(random, shape)));
  for (int i = 0; i < 12; ++i) apply(randomUpdate(random, {{-2, -2, -2}, {2, 2, 2}}, 6));
  EXPECT_TRUE(hasVoxels(result.map, result.voxels));
  EXPECT_EQ(checkMap(result.map), std::vector<std::string>{});
  return result;
}

}  // namespace cuboid_mapping::test
