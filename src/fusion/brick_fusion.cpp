// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/fusion_strategy.h"

namespace cuboid_mapping {
namespace {

/// Voxels of `candidates` that have the given log-odds.
BrickMask findEqual(const DenseBrick& brick, const BrickMask& candidates, float log_odds) {
  BrickMask equal{};
  for (std::size_t z = 0; z < kBrickEdge; ++z) {
    if (candidates[z] == 0) continue;
    const float* slice = &brick.log_odds[64 * z];
    std::uint64_t word = 0;
    for (int voxel = 0; voxel < 64; ++voxel) {
      word |= static_cast<std::uint64_t>(slice[voxel] == log_odds) << voxel;
    }
    equal[z] = word & candidates[z];
  }
  return equal;
}

/// The largest box in the mask with a given least corner, relative to the brick.
CellBox findLargestBox(const BrickMask& mask, const Cell& corner) {
  Cell best_size{0, 0, 0};
  int best_volume = 0;
  std::uint64_t column = ~0ULL;  // Voxels that are in all slices up to the current one.
  for (int depth = 1; corner.z + depth <= kBrickEdge; ++depth) {
    column &= mask[static_cast<std::size_t>(corner.z + depth - 1)];
    std::uint64_t row = 0xFF;  // Voxels that are in all rows up to the current one.
    const std::uint64_t rows = column >> (8 * corner.y);
    for (int height = 1; corner.y + height <= kBrickEdge; ++height) {
      row &= (rows >> (8 * (height - 1)) & 0xFF) >> corner.x;
      const int width = __builtin_ctzll(~row);
      if (width == 0) break;
      const int volume = width * height * depth;
      if (volume > best_volume) {
        best_volume = volume;
        best_size = {width, height, depth};
      }
    }
    if ((column >> (8 * corner.y + corner.x) & 1) == 0) break;
  }
  return {corner, corner + best_size};
}

void erase(BrickMask& mask, const CellBox& box) {
  const std::uint64_t slice = sliceMask(box);
  for (std::int32_t z = box.min.z; z < box.max.z; ++z) mask[static_cast<std::size_t>(z)] &= ~slice;
}

}  // namespace

void BrickFusion::partition(const DenseBrick& brick, std::vector<Cuboid>& cuboids) const {
  BrickMask rest = brick.known;
  for (int z = 0; z < kBrickEdge; ++z) {
    const auto slice = static_cast<std::size_t>(z);
    while (rest[slice] != 0) {
      const int seed = __builtin_ctzll(rest[slice]);
      const float log_odds = brick.log_odds[64 * slice + static_cast<std::size_t>(seed)];
      BrickMask equal = findEqual(brick, rest, log_odds);
      for (std::size_t i = 0; i < kBrickEdge; ++i) rest[i] &= ~equal[i];
      for (int from = z; from < kBrickEdge; ++from) {
        std::uint64_t& left = equal[static_cast<std::size_t>(from)];
        while (left != 0) {
          const int voxel = __builtin_ctzll(left);
          const CellBox box = findLargestBox(equal, {voxel & 7, voxel >> 3, from});
          erase(equal, box);
          cuboids.push_back({{brick.brick + box.min, brick.brick + box.max}, log_odds});
        }
      }
    }
  }
}

}  // namespace cuboid_mapping
