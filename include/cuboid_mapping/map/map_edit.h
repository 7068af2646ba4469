// SPDX-License-Identifier: BSD-3-Clause
// Edits of boxes in metres.
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"

namespace cuboid_mapping {

/// Makes every voxel that a box overlaps free or occupied, with the log-odds of the clamping threshold. Locked
/// voxels change, too. For other log-odds, see CuboidMap::replace().
///
/// @param box_map  Metres, map frame. @param occupancy  kUnknown: as forget().
/// @throws std::invalid_argument  The box is inverted, flat, NaN, or out of the grid's range; nothing has
///         changed.
/// @complexity O(bricks of the box).
ChangeSet fill(CuboidMap& map, const MetricBox& box_map, Occupancy occupancy);

/// Makes every voxel that a box overlaps unknown. @throws std::invalid_argument  as fill().
/// @complexity O(bricks of the box, or all known bricks if these are fewer).
ChangeSet forget(CuboidMap& map, const MetricBox& box_map);

}  // namespace cuboid_mapping
