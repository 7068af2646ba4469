// SPDX-License-Identifier: BSD-3-Clause
// Example:
//     const auto occupied = CuboidFilter::kOccupied;
//     const auto walls = joinCuboids(map, kAllCells, occupied, Budget::unlimited());
//     for (const Cuboid& wall : walls.value) std::cout << wall.box << '\n';
#pragma once

#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/query/answer.h"
#include "cuboid_mapping/query/budget.h"

#include <vector>

namespace cuboid_mapping {

/// The cuboids of a region, joined across bricks: two of one class that share a whole face become one, first
/// along x, then y, then z, until no two do. A wall becomes one cuboid, not tiles of eight voxels.
///
/// Joined cuboids are disjoint and cover exactly the voxels of their class in the region. They and their order
/// depend on the classes of these voxels alone, not on the order of clouds or the fusion of the map.
///
/// Cases:
///   - an empty region, or nothing known in it: kNotFound;
///   - kAllCells: the whole map;
///   - kBudgetSpent: with some of them, or none; if its time is over, not all of these are joined.
///
/// @param classes  Classes to join, each by itself.
/// @complexity O(bricks of the region, or all known bricks if these are fewer; and cuboids), about
/// 0.2 us a cuboid.
Answer<std::vector<Cuboid>> joinCuboids(const CuboidMap& map, const CellBox& region,
                                        CuboidFilter classes, Budget& budget);

}  // namespace cuboid_mapping
