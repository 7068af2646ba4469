// SPDX-License-Identifier: BSD-3-Clause
// Morton numbers of the bricks of a cloud.
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

/// Numbers the bricks of a cloud in the order of isBeforeOnMortonCurve(), whatever base their keys count from.
class MortonOrder {
 public:
  /// Alignment of the base.
  static constexpr std::int32_t kAlignment = 1 << 23;

  /// @param base  A multiple of kAlignment on each axis. Keys reach at most twice as far, so that the curve
  ///              passes at most one such multiple on an axis.
  constexpr explicit MortonOrder(const Cell& base) {
    int rank[3] = {};
    for (int axis = 0; axis < 3; ++axis) {
      // The highest bit in which the two sides of the multiple differ; the lowest axis wins a tie.
      const std::uint32_t middle = static_cast<std::uint32_t>(base[axis]) + kAlignment;
      rank[axis] = (middle == 0 ? 31 : __builtin_ctz(middle)) * 3 - axis;
    }
    for (int axis = 0; axis < 3; ++axis) {
      for (int other = 0; other < 3; ++other) shift_[axis] += rank[other] < rank[axis] ? 1 : 0;
      shift_[axis] += kSideBit;
    }
  }

  /// The number of a brick.
  [[nodiscard]] constexpr std::uint64_t operator()(BrickKey key) const {
    std::uint64_t number = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const BrickKey along = key >> (kBrickKeyBits * axis);
      number |= spreadBits(along & kBelowSide) << (2 - axis);
      number |= (along >> (kBrickKeyBits - 1) & 1) << shift_[axis];
    }
    return number;
  }

 private:
  static constexpr int kSideBit = 3 * (kBrickKeyBits - 1);
  static constexpr BrickKey kBelowSide = (BrickKey{1} << (kBrickKeyBits - 1)) - 1;

  int shift_[3] = {};  ///< Place of the bit of each axis that tells the side of the multiple.
};

}  // namespace cuboid_mapping
