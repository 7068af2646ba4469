// SPDX-License-Identifier: BSD-3-Clause
// Boxes of one log-odds, as files of OctoMap and of version 1 of this package have them, as bricks.
#pragma once

#include "cuboid_mapping/occupancy/cuboid.h"
#include "cuboid_mapping/voxels/voxel_store.h"

#include <optional>
#include <vector>

namespace cuboid_mapping {

/// Answer of toBricks().
struct BricksOfBoxes {
  std::vector<VoxelBrick> bricks;      ///< Along the Morton curve.
  std::optional<CellBox> overlapping;  ///< A box that shares a cell with one before it.
};

/// The voxels of boxes; of one that lies in two, the later box counts. Empty boxes have none.
/// @pre The log-odds are finite. @complexity O(bricks that the boxes share cells with), and their
/// sorting.
[[nodiscard]] BricksOfBoxes toBricks(const std::vector<UniformBox>& boxes);

}  // namespace cuboid_mapping
