// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"

#include <vector>

namespace cuboid_mapping {

/// The voxels of one class in a region, as disjoint boxes that cover exactly these: the fusion
/// `class`, for those who need free, occupied or unknown and nothing else, whatever fusion the map
/// itself uses.
///
/// Bricks that are wholly of the class are divided together with their neighbours in blocks of
/// 8 x 8 x 8 bricks, all others one by one (divideIntoBoxes). No box reaches beyond the region, or
/// beyond a block of 64 x 64 x 64 voxels.
///
/// @param occupancy  Not unknown.
/// @complexity O(blocks of the region that lie in the bounds of the map, and bricks in them).
[[nodiscard]] std::vector<CellBox> findClassBoxes(const CuboidMap& map, const CellBox& region,
                                                  Occupancy occupancy);

}  // namespace cuboid_mapping
