// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/cell_box.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace cuboid_mapping {

/// A brick is an aligned cube of 8 x 8 x 8 voxels, named by its least cell; a mask of its voxels is
/// one 64-bit word per z slice, bit 8 * y + x.
constexpr std::int32_t kBrickEdge = 8;
constexpr int kBrickVoxels = kBrickEdge * kBrickEdge * kBrickEdge;

/// A set of voxels of one brick.
using BrickMask = std::array<std::uint64_t, kBrickEdge>;

/// Least cell of the brick that holds a cell.
[[nodiscard]] constexpr Cell brickOf(const Cell& cell) {
  return {cell.x & ~(kBrickEdge - 1), cell.y & ~(kBrickEdge - 1), cell.z & ~(kBrickEdge - 1)};
}

/// The voxels of a brick as a cell box.
[[nodiscard]] constexpr CellBox brickBox(const Cell& brick) {
  return {brick, {brick.x + kBrickEdge, brick.y + kBrickEdge, brick.z + kBrickEdge}};
}

/// Whether holds(brick) is true for a brick that shares a cell with the box; ends at the first.
template <typename PredicateT>
[[nodiscard]] bool anyBrick(const CellBox& box, PredicateT holds) {
  const Cell first = brickOf(box.min);
  for (std::int32_t z = first.z; z < box.max.z; z += kBrickEdge) {
    for (std::int32_t y = first.y; y < box.max.y; y += kBrickEdge) {
      for (std::int32_t x = first.x; x < box.max.x; x += kBrickEdge) {
        if (holds(Cell{x, y, z})) return true;
      }
    }
  }
  return false;
}

/// A group is an aligned cube of 4 x 4 x 4 bricks, named by its least cell.
constexpr std::int32_t kGroupEdge = 4 * kBrickEdge;
constexpr std::size_t kGroupBricks = 64;

/// Least cell of the group that holds a cell.
[[nodiscard]] constexpr Cell groupOf(const Cell& cell) {
  return {cell.x & ~(kGroupEdge - 1), cell.y & ~(kGroupEdge - 1), cell.z & ~(kGroupEdge - 1)};
}

/// Number of a brick in its group: 16 * z + 4 * y + x in bricks, 0 to 63.
[[nodiscard]] constexpr std::size_t indexInGroup(const Cell& brick) {
  return static_cast<std::size_t>((brick.z >> 3 & 3) << 4 | (brick.y >> 3 & 3) << 2 |
                                  (brick.x >> 3 & 3));
}

/// Number of a voxel in its brick: 64 * z + 8 * y + x, 0 to 511.
[[nodiscard]] constexpr int voxelIndex(const Cell& cell) {
  return ((cell.z & 7) << 6) | ((cell.y & 7) << 3) | (cell.x & 7);
}

/// Bit of a voxel in the word of its z slice.
[[nodiscard]] constexpr std::uint64_t voxelBit(const Cell& cell) {
  return 1ULL << ((cell.y & 7) << 3 | (cell.x & 7));
}

/// Calls visit(cell) for each voxel of a mask of a brick, in the order of voxelIndex().
template <typename VisitorT>
void forEachCell(const Cell& brick, const BrickMask& mask, VisitorT visit) {
  for (std::int32_t z = 0; z < kBrickEdge; ++z) {
    for (std::uint64_t left = mask[static_cast<std::size_t>(z)]; left != 0; left &= left - 1) {
      const int voxel = __builtin_ctzll(left);
      visit(Cell{brick.x + (voxel & 7), brick.y + (voxel >> 3), brick.z + z});
    }
  }
}

/// The voxels of `box` in one z slice of the brick, for each slice that `box` covers.
/// @pre `box` is not empty, and lies in the brick.
[[nodiscard]] constexpr std::uint64_t sliceMask(const CellBox& box) {
  const int width = box.max.x - box.min.x;
  const int height = box.max.y - box.min.y;
  const std::uint64_t row = ((1ULL << width) - 1) << (box.min.x & 7);
  constexpr std::uint64_t kFirstOfEachRow = 0x0101010101010101ULL;
  const std::uint64_t rows = kFirstOfEachRow >> (8 * (8 - height));
  return (row * rows) << (8 * (box.min.y & 7));
}

/// The voxels of a brick that lie in a box, which is not empty and lies in the brick.
[[nodiscard]] inline BrickMask toMask(const CellBox& box) {
  BrickMask mask{};
  const std::uint64_t slice = sliceMask(box);
  for (std::int32_t z = box.min.z; z < box.max.z; ++z)
    mask[static_cast<std::size_t>(z & 7)] = slice;
  return mask;
}

}  // namespace cuboid_mapping
