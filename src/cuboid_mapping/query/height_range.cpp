// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/height_range.h"

#include <algorithm>
#include <map>

namespace cuboid_mapping {

HeightRange findHeightRange(const CuboidMap& map) {
  std::map<std::int32_t, double> layers;  // Occupied voxels by height.
  map.voxels().forEach([&layers](const VoxelBrick& brick) {
    if (!brick.voxels.isAnyOccupied()) return;
    for (int z = 0; z < kBrickEdge; ++z) {
      const int count = __builtin_popcountll(brick.voxels.occupied()[z]);
      if (count > 0) layers[brick.brick.z + z] += count;
    }
  });
  if (layers.empty()) return {};
  // The height below which there is this share of the voxels, in voxels.
  const auto height_at = [&](double share) {
    double missing = share * map.voxels().numOccupiedVoxels();
    for (const auto& [z, count] : layers) {
      if (missing <= count) return z + missing / count;
      missing -= count;
    }
    return layers.rbegin()->first + 1.0;
  };
  constexpr double kShareLeftOut = 0.02;
  const double resolution_m = map.grid().resolution();
  const double min_z = height_at(kShareLeftOut);
  return {min_z * resolution_m,
          std::max(height_at(1.0 - kShareLeftOut), min_z + 0.5) * resolution_m};
}

}  // namespace cuboid_mapping
