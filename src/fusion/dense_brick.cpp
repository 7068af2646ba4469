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

BrickMask DenseBrick::occupied() const {
  BrickMask mask{};
  forEachCell(brick, known, [&](const Cell& cell) {
    const float value = log_odds[static_cast<std::size_t>(voxelIndex(cell))];
    if (classify(value) != Occupancy::kOccupied) return;
    mask[static_cast<std::size_t>(cell.z & 7)] |= voxelBit(cell);
  });
  return mask;
}

bool DenseBrick::apply(const BrickUpdate& update, const SensorModel& sensor_model) {
  bool is_changed = false;
  for (std::size_t z = 0; z < kBrickEdge; ++z) {
    const std::uint64_t hits = update.hits[z];
    const std::uint64_t misses = update.misses[z] & ~hits;
    is_changed |= ((hits | misses) & ~known[z]) != 0;
    known[z] |= hits | misses;
    float* slice = &log_odds[64 * z];
    const auto observe = [&](std::uint64_t voxels, float observation) {
      for (; voxels != 0; voxels &= voxels - 1) {
        float& value = slice[__builtin_ctzll(voxels)];
        const float before = value;
        value = sensor_model.update(before, observation);
        is_changed |= value != before;
      }
    };
    observe(hits, sensor_model.hit());
    observe(misses, sensor_model.miss());
  }
  return is_changed;
}

}  // namespace cuboid_mapping
