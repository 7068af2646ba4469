// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/fusion/growth_config.h"
#include "cuboid_mapping/geometry/cell_box.h"

namespace cuboid_mapping {

/// The order of Figure 5, see SearchStrategy::Order::kPaper.
/// @param width  Width of the cell in voxels (w_i).
[[nodiscard]] SearchDirections paperDirections(const Cell& width);

/// The voxels that an expansion adds to a cell: the expanded box without the box.
/// @param depth  Voxels of the expansion, > 0.
[[nodiscard]] CellBox slabOf(const CellBox& box, SearchDirection direction, std::int32_t depth);

}  // namespace cuboid_mapping
