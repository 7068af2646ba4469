// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/standard_containers.h"

#include <cstddef>
#include <cstdint>
#include <ostream>

namespace cuboid_mapping {

/// Integer name of a voxel: floor(metres / resolution) on each axis.
struct Cell {
  /// The voxel reaches from coordinate * resolution (included) to (coordinate + 1) * resolution (excluded).
  ///@{
  std::int32_t x = 0;
  std::int32_t y = 0;
  std::int32_t z = 0;
  ///@}

  /// Coordinate on axis 0, 1 or 2.
  ///@{
  [[nodiscard]] constexpr std::int32_t operator[](int axis) const {
    return axis == 0 ? x : (axis == 1 ? y : z);
  }
  constexpr std::int32_t& operator[](int axis) { return axis == 0 ? x : (axis == 1 ? y : z); }
  ///@}
};

/// Whether both name the same voxel.
///@{
constexpr bool operator==(const Cell& a, const Cell& b) {
  return a.x == b.x && a.y == b.y && a.z == b.z;
}
constexpr bool operator!=(const Cell& a, const Cell& b) { return !(a == b); }
///@}

/// Lexicographic by z, then y, then x: the order in which a brick numbers its voxels.
constexpr bool operator<(const Cell& a, const Cell& b) {
  return a.z != b.z ? a.z < b.z : (a.y != b.y ? a.y < b.y : a.x < b.x);
}

/// Whether `a` comes before `b` on the Morton curve (z-order), which keeps neighbours together.
/// Compares the axis on which the highest bit differs; works for all int32 coordinates.
constexpr bool isBeforeOnMortonCurve(const Cell& a, const Cell& b) {
  int deciding_axis = 0;
  std::uint32_t deciding_bits = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const std::uint32_t bits =
        static_cast<std::uint32_t>(a[axis]) ^ static_cast<std::uint32_t>(b[axis]);
    const bool has_higher_bit = deciding_bits < bits && deciding_bits < (deciding_bits ^ bits);
    if (has_higher_bit) {
      deciding_axis = axis;
      deciding_bits = bits;
    }
  }
  return a[deciding_axis] < b[deciding_axis];
}

/// Sum and difference, axis by axis. @pre No coordinate of the result is outside int32.
///@{
constexpr Cell operator+(const Cell& a, const Cell& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
constexpr Cell operator-(const Cell& a, const Cell& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
///@}

/// Hash for std::unordered_map, whose sizes libstdc++ chooses prime. Its low bits depend little on z: a table
/// of 2^n slots needs the high bits.
struct CellHash {
  /// The hash: below 2^32, and the same on all machines.
  [[nodiscard]] constexpr std::size_t operator()(const Cell& cell) const {
    constexpr std::uint64_t kGoldenRatio = 0x9E3779B97F4A7C15ULL;
    const auto bits = [](std::int32_t v) {
      return static_cast<std::uint64_t>(static_cast<std::uint32_t>(v));
    };
    const std::uint64_t key = bits(cell.x) ^ bits(cell.y) << 20 ^ bits(cell.z) << 40;
    return static_cast<std::size_t>((key * kGoldenRatio) >> 32);
  }
};

/// Writes "(x y z)".
inline std::ostream& operator<<(std::ostream& out, const Cell& cell) {
  return out << '(' << cell.x << ' ' << cell.y << ' ' << cell.z << ')';
}

}  // namespace cuboid_mapping
