// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/obstacle_cache.h"

#include "cuboid_mapping/voxels/mask_bounds.h"

namespace cuboid_mapping {

void ObstacleCache::look(const Cell& brick, Slot& slot) {
  if (!budget().spend()) return;
  const BrickMask voxels = obstacles_.inBrick(brick);
  slot = {brick, kNothing};
  if (voxels.isEmpty()) return;
  slot.number = static_cast<std::uint32_t>(found_.size());
  found_.push_back({brick, voxels, boundsOf(brick, voxels)});
}

}  // namespace cuboid_mapping
