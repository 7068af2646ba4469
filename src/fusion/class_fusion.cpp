// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/fusion_strategy.h"
#include "cuboid_mapping/fusion/mask_boxes.h"

namespace cuboid_mapping {
namespace {

float meanLogOdds(const DenseBrick& brick, const CellBox& box) {
  MeanLogOdds mean;
  forEachCell(brick.brick, toMask(box), [&](const Cell& cell) {
    mean.add(brick.log_odds[static_cast<std::size_t>(voxelIndex(cell))], 1.0);
  });
  return mean.value();
}

}  // namespace

void ClassFusion::partition(const DenseBrick& brick, std::vector<Cuboid>& cuboids) const {
  const BrickMask occupied = brick.occupied();
  BrickMask free{};
  for (std::size_t z = 0; z < kBrickEdge; ++z) free[z] = brick.known[z] & ~occupied[z];
  for (const BrickMask& mask : {occupied, free}) {
    std::vector<CellBox> boxes;
    divideIntoBoxes(mask, boxes);
    for (const CellBox& box : boxes) {
      const CellBox in_map{brick.brick + box.min, brick.brick + box.max};
      cuboids.push_back({in_map, meanLogOdds(brick, in_map)});
    }
  }
}

}  // namespace cuboid_mapping
