// SPDX-License-Identifier: BSD-3-Clause
// Other ways to cover the occupied voxels of a map by few boxes, to compare coverOccupied() with.
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"

#include <cstddef>
#include <vector>

namespace cuboid_mapping::bench {

/// The cubes of an octree that hold an occupied voxel, of the finest level with at most so many.
[[nodiscard]] std::vector<CellBox> coverByOctree(const CuboidMap& map, std::size_t max_boxes);

/// The tight box around all is halved across its longest edge, and the largest box again and again.
[[nodiscard]] std::vector<CellBox> coverByBisection(const CuboidMap& map, std::size_t max_boxes);

/// Simulated annealing that begins with a cover: at each step a random box is split at a random place and two
/// random neighbours are united, or one box shrinks to what no other one covers.
/// @return The best cover that was met.
[[nodiscard]] std::vector<CellBox> searchCover(const CuboidMap& map, std::vector<CellBox> boxes,
                                               double time_s, unsigned seed);

/// Voxels of the boxes that are not occupied, each counted once.
[[nodiscard]] double countAdded(const CuboidMap& map, const std::vector<CellBox>& boxes);

}  // namespace cuboid_mapping::bench
