// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"

namespace cuboid_mapping {

/// Heights between which colours run, metres.
struct HeightRange {
  double min_m = 0.0;  ///< Lower z, map frame.
  double max_m = 1.0;  ///< Upper z, map frame.
};

/// The heights of the occupied voxels but for the lowest and the highest 2 %, so that a bird or a point
/// under the ground does not take the colours of the rest. From 0 to 1 m for a map without any. Of a map of
/// more than 50,000 bricks, a part is looked at, which depends on where the bricks lie only.
/// @complexity O(bricks).
[[nodiscard]] HeightRange findHeightRange(const CuboidMap& map);

}  // namespace cuboid_mapping
