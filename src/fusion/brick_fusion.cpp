// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/fusion_strategy.h"
#include "cuboid_mapping/fusion/mask_boxes.h"
#include "cuboid_mapping/rtree/slot_set.h"

namespace cuboid_mapping {
namespace {

/// Voxels of `candidates` that have the given log-odds.
BrickMask findEqual(const DenseBrick& brick, const BrickMask& candidates, float log_odds) {
  BrickMask equal{};
  for (std::size_t z = 0; z < kBrickEdge; ++z) {
    if (candidates[z] == 0) continue;
    const float* slice = &brick.log_odds[64 * z];
    const SlotSet word = findSlots(64, [&](int voxel) { return slice[voxel] == log_odds; });
    equal[z] = word & candidates[z];
  }
  return equal;
}

}  // namespace

void BrickFusion::partition(const DenseBrick& brick, std::vector<Cuboid>& cuboids) const {
  BrickMask rest = brick.known;
  std::vector<CellBox> boxes;
  for (int z = 0; z < kBrickEdge; ++z) {
    const auto slice = static_cast<std::size_t>(z);
    while (rest[slice] != 0) {
      const int seed = __builtin_ctzll(rest[slice]);
      const float log_odds = brick.log_odds[64 * slice + static_cast<std::size_t>(seed)];
      const BrickMask equal = findEqual(brick, rest, log_odds);
      for (std::size_t i = 0; i < kBrickEdge; ++i) rest[i] &= ~equal[i];
      boxes.clear();
      divideIntoBoxes(equal, boxes);
      for (const CellBox& box : boxes) {
        cuboids.push_back({{brick.brick + box.min, brick.brick + box.max}, log_odds});
      }
    }
  }
}

}  // namespace cuboid_mapping
