// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/dense_brick.h"

#include <algorithm>

namespace cuboid_mapping {

void DenseBrick::fill(const Cuboid& cuboid) {
  const CellBox part = intersect(cuboid.box, brickBox(brick));
  if (part.isEmpty()) return;
  const std::uint64_t mask = sliceMask(part);
  const int width = part.max.x - part.min.x;
  for (std::int32_t z = part.min.z; z < part.max.z; ++z) {
    known[static_cast<std::size_t>(z & 7)] |= mask;
    for (std::int32_t y = part.min.y; y < part.max.y; ++y) {
      float* row = &log_odds[static_cast<std::size_t>(voxelIndex({part.min.x, y, z}))];
      std::fill(row, row + width, cuboid.log_odds);
    }
  }
}

void DenseBrick::apply(const BrickUpdate& update, const SensorModel& sensor_model) {
  for (std::size_t z = 0; z < kBrickEdge; ++z) {
    const std::uint64_t hits = update.hits[z];
    std::uint64_t observed = hits | update.misses[z];
    const std::uint64_t known_before = known[z];
    known[z] |= observed;
    float* slice = &log_odds[64 * z];
    while (observed != 0) {
      const int voxel = __builtin_ctzll(observed);
      observed &= observed - 1;
      const float before = (known_before >> voxel & 1) != 0 ? slice[voxel] : 0.0F;
      const bool is_hit = (hits >> voxel & 1) != 0;
      slice[voxel] = sensor_model.update(before, is_hit ? sensor_model.hit() : sensor_model.miss());
    }
  }
}

}  // namespace cuboid_mapping
