// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/occupancy/cuboid.h"
#include "cuboid_mapping/voxels/voxel_store.h"

#include <vector>

namespace cuboid_mapping {

/// Divides voxels of one class of a brick into disjoint cuboids, as DividedBrick::add(), and appends them.
void divideVoxels(const Cell& brick, const BrickMask& voxels, Occupancy occupancy,
                  std::vector<Cuboid>& cuboids);

/// Appends the cuboids of a brick, occupied ones first: the voxels of each class as
/// divideVoxels() divides them.
void divideBrick(const VoxelBrick& brick, std::vector<Cuboid>& cuboids);

}  // namespace cuboid_mapping
