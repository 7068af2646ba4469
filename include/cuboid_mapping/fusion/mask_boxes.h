// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/brick.h"

#include <vector>

namespace cuboid_mapping {

/// Divides a mask of a brick into disjoint boxes that cover exactly its voxels, appended to `boxes`.
///
/// The least voxel that is left (in the order z, y, x) takes the largest box of which it is the
/// least corner; ties go to the lower box. The result depends on the mask only.
/// @param boxes  Relative to the brick: from 0 to 8 on each axis.
void divideIntoBoxes(BrickMask mask, std::vector<CellBox>& boxes);

}  // namespace cuboid_mapping
