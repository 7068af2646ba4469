// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/fusion_strategy.h"
#include "cuboid_mapping/fusion/mask_boxes.h"

#include <algorithm>
#include <limits>

namespace cuboid_mapping {
namespace {

/// Log-odds of the mean probability of a box's voxels; exactly theirs when all are the same.
float meanLogOdds(const DenseBrick& brick, const CellBox& box) {
  float least = std::numeric_limits<float>::max();
  float greatest = std::numeric_limits<float>::lowest();
  double sum = 0.0;
  forEachCell(brick.brick, toMask(box), [&](const Cell& cell) {
    const float log_odds = brick.log_odds[static_cast<std::size_t>(voxelIndex(cell))];
    least = std::min(least, log_odds);
    greatest = std::max(greatest, log_odds);
    sum += toProbability(log_odds);
  });
  if (least == greatest) return least;
  return std::clamp(toLogOdds(sum / box.numVoxels()), least, greatest);
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
