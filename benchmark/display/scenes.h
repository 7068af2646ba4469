// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"

#include <string>

namespace cuboid_mapping_rviz::bench {

/// Rolling ground around the origin as a scanner sees it: a shell two to four voxels of 0.1 m thick, rough, fused.
/// @param num_boxes  Its occupied cuboids, about.
[[nodiscard]] cuboid_mapping::CuboidMap makeGround(double num_boxes);

/// The map of a file. Throws what readMapFile() throws.
[[nodiscard]] cuboid_mapping::CuboidMap loadMap(const std::string& file);

}  // namespace cuboid_mapping_rviz::bench
