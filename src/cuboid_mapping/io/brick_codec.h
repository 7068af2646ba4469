// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/map_image.h"

#include <cstdint>
#include <vector>

namespace cuboid_mapping {

/// Bricks as they travel: about a third of their size. msg/CuboidBricks.msg says what is in them. Part of the
/// client and of the Python module, not of cuboid_mapping::io: needs zlib alone.
struct PackedBricks {
  std::uint32_t num_bricks = 0;
  std::uint32_t num_cuboids = 0;
  bool has_values = false;
  std::vector<float> values;       ///< Log-odds that occur, each once.
  std::vector<std::uint8_t> data;  ///< The arrays, one after the other, deflated.
};

/// @throws std::length_error when they are too many for a message; says what to do.
/// @complexity O(n) for n cuboids, with values voxels, and the deflation.
[[nodiscard]] PackedBricks packBricks(const BrickArrays& arrays);

/// Inverse of packBricks(). @return false when the message is damaged.
[[nodiscard]] bool unpackBricks(const PackedBricks& packed, BrickArrays& arrays);

}  // namespace cuboid_mapping
