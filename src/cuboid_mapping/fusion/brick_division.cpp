// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/brick_division.h"

#include "cuboid_mapping/voxels/brick_cuboids.h"

namespace cuboid_mapping {

void divideVoxels(const Cell& brick, const BrickMask& voxels, Occupancy occupancy,
                  std::vector<Cuboid>& cuboids) {
  DividedBrick divided;
  divided.add(voxels);
  for (int i = 0; i < divided.count; ++i) {
    cuboids.push_back(unpackCuboid(brick, divided.boxes[static_cast<std::size_t>(i)], occupancy));
  }
}

void divideBrick(const VoxelBrick& brick, std::vector<Cuboid>& cuboids) {
  divideVoxels(brick.brick, brick.voxels.occupied(), Occupancy::kOccupied, cuboids);
  divideVoxels(brick.brick, brick.voxels.free(), Occupancy::kFree, cuboids);
}

}  // namespace cuboid_mapping
