// SPDX-License-Identifier: BSD-3-Clause
// How far the division into cuboids is from the least number of boxes.
#pragma once

#include "cuboid_mapping/occupancy/cuboid.h"
#include "cuboid_mapping/voxels/voxel_store.h"

#include <array>
#include <cstddef>
#include <vector>

namespace cuboid_mapping::bench {

/// Boxes that bricks can be divided into, both classes together.
struct BoxCounts {
  std::size_t bricks = 0;   ///< That were looked at.
  std::size_t cuboids = 0;  ///< As the map divides them.
  /// The same with the best of the 48 orders of each brick and class.
  std::size_t best_of_orders = 0;
  std::size_t lower_bound = 0;  ///< No division has fewer.
};

/// Looks at every n-th brick, about `max_bricks` of them.
///
/// The lower bound is a set of voxels of which no two can be in one box, because the box round them
/// holds a voxel of another class: each needs a box of its own.
[[nodiscard]] BoxCounts countBoxes(const VoxelStore& voxels, std::size_t max_bricks);

/// Cuboids that are left when neighbours of one class that form a box are joined, wherever bricks
/// end, until there are none. @param axes  Order in which they are joined; the count depends on it.
[[nodiscard]] std::size_t countJoined(std::vector<Cuboid> cuboids,
                                      const std::array<int, 3>& axes = {0, 1, 2});

}  // namespace cuboid_mapping::bench
