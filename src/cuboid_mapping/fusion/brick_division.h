// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/occupancy/cuboid.h"
#include "cuboid_mapping/voxels/voxel_store.h"

#include <vector>

namespace cuboid_mapping {

/// Divides a set of voxels of a brick into disjoint boxes that cover exactly these, appended.
///
/// The least voxel that is left (in the order z, y, x) takes the largest box of which it is the
/// least corner; ties go to the lower box. The result depends on the set only.
/// @param boxes  Relative to the brick: from 0 to 8 on each axis.
void divideIntoBoxes(BrickMask mask, std::vector<CellBox>& boxes);

/// The cuboids of a brick, occupied ones first, appended: the voxels of each class as
/// divideIntoBoxes() divides them.
void divideBrick(const VoxelBrick& brick, std::vector<Cuboid>& cuboids);

}  // namespace cuboid_mapping
