// SPDX-License-Identifier: BSD-3-Clause
// Boxes small enough to try every choice.
#pragma once

#include "support/voxel_map.h"

#include <cstdint>

namespace cuboid_mapping::test {

/// Voxels of kSmall as bits.
using Bits = std::uint32_t;
constexpr CellBox kSmall{{0, 0, 0}, {4, 3, 2}};

/// @pre the box lies in kSmall.
[[nodiscard]] inline Bits bitsOf(const CellBox& box) {
  Bits bits = 0;
  visitCells(box,
             [&](const Cell& cell) { bits |= Bits{1} << (12 * cell.z + 4 * cell.y + cell.x); });
  return bits;
}

}  // namespace cuboid_mapping::test
