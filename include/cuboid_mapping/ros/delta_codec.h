// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/map_image.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace cuboid_mapping_ros {

/// The arrays of a delta as they travel: about a third of their size. msg/CuboidMapUpdate.msg says
/// what is in them.
struct PackedDelta {
  std::uint32_t num_boxes = 0;
  std::uint32_t num_cuboids = 0;
  std::vector<float> values;       ///< Log-odds that occur, each once.
  std::vector<std::uint8_t> data;  ///< The other arrays, one after the other, deflated.
};

/// @return Nothing when more than 65,536 values occur, which no sensor model gives.
/// @complexity O(n log v) for n cuboids of v values, and the deflation.
[[nodiscard]] std::optional<PackedDelta> packArrays(const cuboid_mapping::MapDelta& delta);

/// Fills the arrays of a delta. @return false when they are damaged.
[[nodiscard]] bool unpackArrays(const PackedDelta& packed, cuboid_mapping::MapDelta& delta);

}  // namespace cuboid_mapping_ros
