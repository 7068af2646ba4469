// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/occupancy/cuboid.h"
#include "cuboid_mapping/voxels/brick_table.h"

#include <cstdint>
#include <vector>

namespace cuboid_mapping {

/// A voxel that was split out of a fused cuboid. It must keep its value for some clouds before it may fuse again:
/// hysteresis, so that a flickering voxel does not split and rebuild a large cuboid at every cloud.
struct HeldVoxel {
  std::uint64_t last_change;  ///< Number of the cloud that last changed its value.
  int voxel;                  ///< See voxelIndex().
};

/// The result of growth in a brick. All known voxels that are not fused are single cells.
struct GrownBrick {
  Cell brick;
  BrickMask fused;              ///< Voxels of fused cuboids.
  std::vector<Cuboid> cuboids;  ///< Fused cuboids that share a voxel with the brick, in any order.
  std::vector<HeldVoxel> held;  ///< Voxels that may not fuse yet.

  /// Whether there is nothing to keep.
  [[nodiscard]] bool isEmpty() const { return cuboids.empty() && held.empty(); }
};

/// The bricks of a map with a fused or a held voxel.
using GrownBricks = BrickTable<GrownBrick>;

}  // namespace cuboid_mapping
