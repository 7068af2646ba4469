// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/voxels/voxel_store.h"

#include <cstddef>
#include <vector>

namespace cuboid_mapping::bench {

/// Answer of findVoxelPath().
struct VoxelPath {
  std::vector<Cell> voxels;     ///< From start to goal; empty when there is no path.
  double length = 0.0;          ///< From centre to centre, in edges of a voxel.
  std::size_t num_reached = 0;  ///< Voxels that the search has come to.
};

/// The shortest path of a robot of one voxel through free voxels, in steps to the 26 around: one across
/// an edge or a corner needs all voxels that the robot meets on it to be free.
///
/// A* with the length of such a path through empty space as estimate, so that none is shorter. Steps
/// have 26 directions only: a straight line may be up to 12 % shorter still.
/// @complexity O(n log n) for n voxels reached.
[[nodiscard]] VoxelPath findVoxelPath(const VoxelStore& voxels, const Cell& start,
                                      const Cell& goal);

}  // namespace cuboid_mapping::bench
