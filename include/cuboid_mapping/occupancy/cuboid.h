// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/cell_box.h"
#include "cuboid_mapping/occupancy/sensor_model.h"

namespace cuboid_mapping {

/// A grid cell of the paper (g_i = (D_i, P(g_i))): a box of voxels of one class, which is not
/// unknown. The log-odds of its voxels are kept apart from it, see VoxelStore.
struct Cuboid {
  CellBox box;                             ///< Its voxels; not empty.
  Occupancy occupancy = Occupancy::kFree;  ///< Class of all of them; not kUnknown.

  /// Whether its voxels are occupied; else they are free.
  [[nodiscard]] constexpr bool isOccupied() const { return occupancy == Occupancy::kOccupied; }
};

/// Whether box and class are equal.
///@{
constexpr bool operator==(const Cuboid& a, const Cuboid& b) {
  return a.box == b.box && a.occupancy == b.occupancy;
}
constexpr bool operator!=(const Cuboid& a, const Cuboid& b) { return !(a == b); }
///@}

/// A box of voxels that all have one log-odds.
struct UniformBox {
  CellBox box;            ///< Its voxels.
  float log_odds = 0.0F;  ///< Log-odds of each voxel.
};

/// Whether box and log-odds are equal, exactly.
///@{
constexpr bool operator==(const UniformBox& a, const UniformBox& b) {
  return a.box == b.box && a.log_odds == b.log_odds;
}
constexpr bool operator!=(const UniformBox& a, const UniformBox& b) { return !(a == b); }
///@}

}  // namespace cuboid_mapping
