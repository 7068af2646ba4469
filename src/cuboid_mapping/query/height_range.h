// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"

namespace cuboid_mapping {

/// Heights of the first and the last colour, metres.
struct HeightRange {
  double min_m = 0.0;  ///< Lower z, map frame.
  double max_m = 1.0;  ///< Upper z, map frame.
};

/// The heights of the occupied voxels without the lowest and the highest 2 %, so that a bird or a point under
/// the ground does not change the colours of the rest. 0 to 1 m without occupied voxels. Maps of
/// 50,000 bricks or more are sampled, the same bricks for the same map.
/// @complexity O(bricks).
[[nodiscard]] HeightRange findHeightRange(const CuboidMap& map);

}  // namespace cuboid_mapping
