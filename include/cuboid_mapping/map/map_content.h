// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/occupancy/cuboid.h"

#include <cstddef>

namespace cuboid_mapping {

/// How much a map holds.
struct MapContent {
  std::size_t free_cuboids = 0;
  std::size_t occupied_cuboids = 0;
  double free_voxels = 0.0;
  double occupied_voxels = 0.0;

  /// Adds a cuboid (sign 1), or takes it away (-1).
  void count(const Cuboid& cuboid, int sign) {
    const bool is_occupied = cuboid.occupancy() == Occupancy::kOccupied;
    (is_occupied ? occupied_cuboids : free_cuboids) += static_cast<std::size_t>(sign);
    (is_occupied ? occupied_voxels : free_voxels) += sign * cuboid.box.numVoxels();
  }
};

}  // namespace cuboid_mapping
