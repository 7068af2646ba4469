// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/brick.h"

#include <algorithm>
#include <cstdint>

namespace cuboid_mapping {

/// Box around the voxels of a set. @pre It is not empty.
[[nodiscard]] inline CellBox boundsOf(const Cell& brick, const BrickMask& mask) {
  std::uint64_t slices = 0;  // Voxels that are in any slice.
  int first = kBrickEdge;
  int last = 0;
  for (int z = 0; z < kBrickEdge; ++z) {
    if (mask[z] == 0) continue;
    slices |= mask[z];
    first = std::min(first, z);
    last = z;
  }
  std::uint64_t row = slices | slices >> 32;
  row |= row >> 16;
  row |= row >> 8;
  row &= 0xFF;
  const int least_row = __builtin_ctzll(slices) >> 3;
  const int last_row = (63 - __builtin_clzll(slices)) >> 3;
  return {brick + Cell{__builtin_ctzll(row), least_row, first},
          brick + Cell{64 - __builtin_clzll(row), last_row + 1, last + 1}};
}

}  // namespace cuboid_mapping
