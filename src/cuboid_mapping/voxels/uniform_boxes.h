// SPDX-License-Identifier: BSD-3-Clause
// Converts boxes of one log-odds, from files and edits, to bricks.
#pragma once

#include "cuboid_mapping/occupancy/cuboid.h"
#include "cuboid_mapping/voxels/voxel_store.h"

#include <optional>
#include <vector>

namespace cuboid_mapping {

/// Answer of toBricks().
struct BricksOfBoxes {
  std::vector<VoxelBrick> bricks;      ///< Bricks along the Morton curve.
  std::optional<CellBox> overlapping;  ///< A box that shares a cell with an earlier one.
};

/// The voxels of boxes; where two boxes overlap, the later one counts. Empty boxes have none.
/// @pre The log-odds are finite. @complexity O(bricks that the boxes share cells with), and their
/// sorting.
[[nodiscard]] BricksOfBoxes toBricks(const std::vector<UniformBox>& boxes);

}  // namespace cuboid_mapping
