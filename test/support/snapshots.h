// SPDX-License-Identifier: BSD-3-Clause
// Random contents of maps for the tests of files.
#pragma once

#include "cuboid_mapping/map/map_snapshot.h"
#include "support/modelled_map.h"

#include <algorithm>
#include <map>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace cuboid_mapping::test {

/// Content of a random map with a random configuration.
/// @param offset  Shifts the map; in voxels, a multiple of 8.
inline MapSnapshot randomSnapshot(Random& random, const Cell& offset = {}) {
  MapConfig config;
  config.resolution_m = random.real(0.01, 0.5);
  config.sensor_model.hit = random.real(0.6, 0.9);
  config.sensor_model.alpha_max = random.real(0.9, 0.98);
  config.environment = random.chance(0.5) ? Environment::kDynamic : Environment::kStatic;
  config.fusion = random.chance(0.8) ? FusionKind::kClass : FusionKind::kNone;
  return takeSnapshot(randomMap(random, config, offset).map, "odom");
}

inline bool isSameModel(const SensorModelConfig& a, const SensorModelConfig& b) {
  return std::tie(a.hit, a.miss, a.alpha_min, a.alpha_max) ==
         std::tie(b.hit, b.miss, b.alpha_min, b.alpha_max);
}

/// The voxels of bricks.
inline std::map<Cell, float> voxelsOf(const std::vector<VoxelBrick>& bricks) {
  std::vector<std::pair<Cell, float>> sorted;
  for (const VoxelBrick& brick : bricks) {
    brick.voxels.forEachValue([&](float log_odds, const BrickMask& of_value) {
      forEachCell(brick.brick, of_value,
                  [&](const Cell& cell) { sorted.emplace_back(cell, log_odds); });
    });
  }
  // A map takes what comes in its order much faster.
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::map<Cell, float> voxels;
  for (const auto& [cell, log_odds] : sorted) {
    EXPECT_TRUE(voxels.empty() || voxels.rbegin()->first < cell) << cell << " is there twice";
    voxels.emplace_hint(voxels.end(), cell, log_odds);
  }
  return voxels;
}

/// Share of the voxels of the larger map that both know with the same class.
inline double shareOfSameClasses(const MapSnapshot& a, const MapSnapshot& b) {
  const std::map<Cell, float> of_a = voxelsOf(a.bricks);
  const std::map<Cell, float> of_b = voxelsOf(b.bricks);
  const auto num_same = std::count_if(of_a.begin(), of_a.end(), [&of_b](const auto& voxel) {
    const auto other = of_b.find(voxel.first);
    return other != of_b.end() && (other->second >= 0.0F) == (voxel.second >= 0.0F);
  });
  return static_cast<double>(num_same) / static_cast<double>(std::max(of_a.size(), of_b.size()));
}

/// The voxels of a map.
inline std::map<Cell, float> voxelsOf(const CuboidMap& map) {
  return voxelsOf(takeSnapshot(map, "").bricks);
}

}  // namespace cuboid_mapping::test
