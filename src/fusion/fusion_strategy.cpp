// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/fusion_strategy.h"

namespace cuboid_mapping {

void NoFusion::partition(const DenseBrick& brick, std::vector<Cuboid>& cuboids) const {
  for (int voxel = 0; voxel < kBrickVoxels; ++voxel) {
    if ((brick.known[static_cast<std::size_t>(voxel >> 6)] >> (voxel & 63) & 1) == 0) continue;
    const Cell cell = brick.brick + Cell{voxel & 7, voxel >> 3 & 7, voxel >> 6};
    cuboids.push_back({CellBox::ofCell(cell), brick.log_odds[static_cast<std::size_t>(voxel)]});
  }
}

const std::vector<std::string>& fusionNames() {
  static const std::vector<std::string> kNames{"brick", "class", kGrowthFusion, "none"};
  return kNames;
}

std::unique_ptr<FusionStrategy> makeFusion(const std::string& name) {
  if (name == "brick") return std::make_unique<BrickFusion>();
  if (name == "class") return std::make_unique<ClassFusion>();
  if (name == "none") return std::make_unique<NoFusion>();
  return nullptr;
}

}  // namespace cuboid_mapping
