// SPDX-License-Identifier: BSD-3-Clause
// Morton numbers of bricks with 21 bits per axis.
#pragma once

#include "cuboid_mapping/scan/beam_marks.h"

#include <cstdint>

namespace cuboid_mapping {

/// Puts two zero bits before each of the 21 low bits.
[[nodiscard]] constexpr std::uint64_t spreadBits(std::uint64_t value) {
  value &= 0x1FFFFF;
  value = (value | value << 32) & 0x1F00000000FFFFULL;
  value = (value | value << 16) & 0x1F0000FF0000FFULL;
  value = (value | value << 8) & 0x100F00F00F00F00FULL;
  value = (value | value << 4) & 0x10C30C30C30C30C3ULL;
  return (value | value << 2) & 0x1249249249249249ULL;
}

/// Gathers every third bit, from the lowest on: inverse of spreadBits().
[[nodiscard]] constexpr std::uint64_t gatherBits(std::uint64_t value) {
  value &= 0x1249249249249249ULL;
  value = (value | value >> 2) & 0x10C30C30C30C30C3ULL;
  value = (value | value >> 4) & 0x100F00F00F00F00FULL;
  value = (value | value >> 8) & 0x1F0000FF0000FFULL;
  value = (value | value >> 16) & 0x1F00000000FFFFULL;
  return (value | value >> 32) & 0x1FFFFF;
}

[[nodiscard]] constexpr std::uint64_t toMorton(BrickKey key) {
  return spreadBits(key) | spreadBits(key >> kBrickKeyBits) << 1 |
         spreadBits(key >> (2 * kBrickKeyBits)) << 2;
}

/// Inverse of toMorton(): the least cell of the brick, counted from the base of the numbers.
[[nodiscard]] constexpr Cell cellOfMorton(std::uint64_t morton) {
  return {static_cast<std::int32_t>(gatherBits(morton)) * kBrickEdge,
          static_cast<std::int32_t>(gatherBits(morton >> 1)) * kBrickEdge,
          static_cast<std::int32_t>(gatherBits(morton >> 2)) * kBrickEdge};
}

}  // namespace cuboid_mapping
