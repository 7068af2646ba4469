// SPDX-License-Identifier: BSD-3-Clause
// Edits of boxes in metres.
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"

namespace cuboid_mapping {

/// Makes every voxel that a box overlaps free or occupied, as sure as clouds can make it: its log-odds become the
/// clamping threshold. Locked voxels are replaced, too. For more, see CuboidMap::replace().
///
/// @param box_map  Metres, map frame. @param occupancy  kUnknown: as forget().
/// @throws std::invalid_argument  The box is inverted, flat, NaN, or out of the grid's range; nothing has changed.
/// @complexity O(bricks of the box).
ChangeSet fill(CuboidMap& map, const MetricBox& box_map, Occupancy occupancy);

/// Makes every voxel that a box overlaps unknown. @throws std::invalid_argument  as fill().
/// @complexity O(known bricks of the box).
ChangeSet forget(CuboidMap& map, const MetricBox& box_map);

}  // namespace cuboid_mapping
