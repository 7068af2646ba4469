// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/height_range.h"

#include <algorithm>
#include <array>
#include <map>
#include <utility>
#include <vector>

namespace cuboid_mapping {
namespace {

/// Number of occupied voxels at each height that has some.
using Layers = std::vector<std::pair<std::int32_t, double>>;

/// Samples every step-th brick.
Layers countLayers(const CuboidMap& map, std::size_t step) {
  std::map<std::int32_t, std::array<double, kBrickEdge>> counts;  // By the height of a brick.
  map.voxels().forEach([&](const VoxelBrick& brick) {
    if (CellHash()(brick.brick) % step != 0 || !brick.voxels.isAnyOccupied()) return;
    const BrickMask occupied = brick.voxels.occupied();
    std::array<double, kBrickEdge>& of_bricks = counts[brick.brick.z];
    for (int z = 0; z < kBrickEdge; ++z) {
      of_bricks[static_cast<std::size_t>(z)] += __builtin_popcountll(occupied[z]);
    }
  });
  Layers layers;
  for (const auto& [brick_z, of_bricks] : counts) {
    for (int z = 0; z < kBrickEdge; ++z) {
      const double count = of_bricks[static_cast<std::size_t>(z)];
      if (count > 0.0) layers.emplace_back(brick_z + z, count);
    }
  }
  return layers;
}

}  // namespace

HeightRange findHeightRange(const CuboidMap& map) {
  constexpr std::size_t kEnoughBricks = 50'000;
  Layers layers = countLayers(map, 1 + map.voxels().size() / kEnoughBricks);
  if (layers.empty()) layers = countLayers(map, 1);
  if (layers.empty()) return {};
  double num_voxels = 0.0;
  for (const auto& layer : layers) num_voxels += layer.second;
  // The height below which this share of the voxels lies, in voxels.
  const auto height_at = [&](double share) {
    double missing = share * num_voxels;
    for (const auto& [z, count] : layers) {
      if (missing <= count) return z + missing / count;
      missing -= count;
    }
    return layers.back().first + 1.0;
  };
  constexpr double kShareLeftOut = 0.02;
  const double resolution_m = map.grid().resolution();
  const double min_z = height_at(kShareLeftOut);
  return {min_z * resolution_m,
          std::max(height_at(1.0 - kShareLeftOut), min_z + 0.5) * resolution_m};
}

}  // namespace cuboid_mapping
