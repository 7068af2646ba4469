// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/brick_division.h"

namespace cuboid_mapping {
namespace {

/// The largest box in the mask with a given least corner, relative to the brick.
CellBox findLargestBox(const BrickMask& mask, const Cell& corner) {
  Cell best_size{0, 0, 0};
  int best_volume = 0;
  std::uint64_t column = ~0ULL;  // Voxels that are in all slices up to the current one.
  for (int depth = 1; corner.z + depth <= kBrickEdge; ++depth) {
    column &= mask[corner.z + depth - 1];
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

}  // namespace

void divideVoxels(const Cell& brick, BrickMask voxels, Occupancy occupancy,
                  std::vector<Cuboid>& cuboids) {
  if (voxels.isFull()) {
    cuboids.push_back({brickBox(brick), occupancy});
    return;
  }
  for (int z = 0; z < kBrickEdge; ++z) {
    while (voxels[z] != 0) {
      const int voxel = __builtin_ctzll(voxels[z]);
      const CellBox box = findLargestBox(voxels, {voxel & 7, voxel >> 3, z});
      cuboids.push_back({{brick + box.min, brick + box.max}, occupancy});
      voxels &= ~BrickMask::ofBox(box);
    }
  }
}

void divideBrick(const VoxelBrick& brick, std::vector<Cuboid>& cuboids) {
  divideVoxels(brick.brick, brick.voxels.occupied(), Occupancy::kOccupied, cuboids);
  divideVoxels(brick.brick, brick.voxels.free(), Occupancy::kFree, cuboids);
}

}  // namespace cuboid_mapping
