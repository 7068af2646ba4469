// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/brick.h"
#include "cuboid_mapping/occupancy/cuboid.h"
#include "cuboid_mapping/occupancy/sensor_model.h"
#include "cuboid_mapping/scan/scan_update.h"

#include <array>

namespace cuboid_mapping {

/// A brick with its cuboids decoded into voxels.
struct DenseBrick {
  Cell brick;
  BrickMask known{};
  std::array<float, kBrickVoxels> log_odds{};  ///< By voxelIndex; 0 where unknown.

  /// Gives all voxels of the brick that are in the cuboid its log-odds.
  void fill(const Cuboid& cuboid);

  /// The known voxels that are occupied.
  [[nodiscard]] BrickMask occupied() const;

  /// Updates every observed voxel once; a voxel that was unknown starts from 0. Hits win.
  /// @return Whether any voxel has changed.
  bool apply(const BrickUpdate& update, const SensorModel& sensor_model);
};

/// What writing a brick to the R-tree has done to its voxels.
struct BrickChange {
  Cell brick;
  BrickMask changed{};  ///< New, or another value.
  BrickMask split{};    ///< Those of them that were in a cuboid of several voxels.
};

}  // namespace cuboid_mapping
