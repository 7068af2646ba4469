// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"

#include <vector>

namespace cuboid_mapping_ros {

/// A map of some boxes, with voxels of half a metre.
inline cuboid_mapping::CuboidMap makeMap(const std::vector<cuboid_mapping::UniformBox>& boxes) {
  cuboid_mapping::MapConfig config;
  config.resolution_m = 0.5;
  cuboid_mapping::CuboidMap map(config);
  map.replace(cuboid_mapping::kAllCells, boxes);
  return map;
}

}  // namespace cuboid_mapping_ros
