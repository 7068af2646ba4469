// SPDX-License-Identifier: BSD-3-Clause
// Bricks and groups of bricks.
#pragma once

#include "cuboid_mapping/geometry/brick_mask.h"

#include <algorithm>
#include <vector>

namespace cuboid_mapping {

/// Least cell of the brick that holds a cell.
[[nodiscard]] constexpr Cell brickOf(const Cell& cell) {
  return {cell.x & ~(kBrickEdge - 1), cell.y & ~(kBrickEdge - 1), cell.z & ~(kBrickEdge - 1)};
}

/// The voxels of a brick as a cell box.
[[nodiscard]] constexpr CellBox brickBox(const Cell& brick) {
  return {brick, {brick.x + kBrickEdge, brick.y + kBrickEdge, brick.z + kBrickEdge}};
}

/// The voxel of a brick with this number; inverse of voxelIndex().
[[nodiscard]] constexpr Cell cellAt(const Cell& brick, int voxel) {
  return {brick.x + (voxel & 7), brick.y + (voxel >> 3 & 7), brick.z + (voxel >> 6)};
}

/// Number of bricks that share a cell with a box. Exact up to 2^53.
[[nodiscard]] constexpr double numBricks(const CellBox& box) {
  double count = box.isEmpty() ? 0.0 : 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    count *= ((box.max[axis] - 1) >> 3) - (box.min[axis] >> 3) + 1.0;
  }
  return count;
}

/// Whether holds(brick) is true for a brick that shares a cell with the box; stops at the first. Bricks are
/// tried in the order of their least cells. @complexity O(numBricks(box)).
template <typename PredicateT>
[[nodiscard]] bool anyBrick(const CellBox& box, PredicateT holds) {
  if (box.isEmpty()) return false;
  const Cell first = brickOf(box.min);
  // In 64 bits: a box may reach to the end of int32.
  for (std::int64_t z = first.z; z < box.max.z; z += kBrickEdge) {
    for (std::int64_t y = first.y; y < box.max.y; y += kBrickEdge) {
      for (std::int64_t x = first.x; x < box.max.x; x += kBrickEdge) {
        const Cell brick{static_cast<std::int32_t>(x), static_cast<std::int32_t>(y),
                         static_cast<std::int32_t>(z)};
        if (holds(brick)) return true;
      }
    }
  }
  return false;
}

/// Calls visit(brick) for each brick that shares a cell with the box, in the order of anyBrick().
template <typename VisitorT>
void forEachBrick(const CellBox& box, VisitorT visit) {
  (void)anyBrick(box, [&](const Cell& brick) {
    visit(brick);
    return false;
  });
}

/// Calls visit(cell) for each voxel of a set, in the order of voxelIndex().
template <typename VisitorT>
void forEachCell(const Cell& brick, const BrickMask& mask, VisitorT visit) {
  mask.forEach([&](int voxel) { visit(cellAt(brick, voxel)); });
}

/// Sorts items along the Morton curve, each by its member `brick`. @complexity O(n log n).
template <typename ItemT>
void sortBricks(std::vector<ItemT>& items) {
  std::sort(items.begin(), items.end(),
            [](const ItemT& a, const ItemT& b) { return isBeforeOnMortonCurve(a.brick, b.brick); });
}

/// Edge of a group in voxels, and its number of bricks. A group is an aligned cube of 4 x 4 x 4 bricks, named
/// by its least cell.
///@{
constexpr std::int32_t kGroupEdge = 4 * kBrickEdge;
constexpr std::size_t kGroupBricks = 64;
///@}

/// Least cell of the group that holds a cell.
[[nodiscard]] constexpr Cell groupOf(const Cell& cell) {
  return {cell.x & ~(kGroupEdge - 1), cell.y & ~(kGroupEdge - 1), cell.z & ~(kGroupEdge - 1)};
}

/// Number of a brick in its group: 16 * z + 4 * y + x in bricks, 0 to 63.
[[nodiscard]] constexpr std::size_t indexInGroup(const Cell& brick) {
  return static_cast<std::size_t>((brick.z >> 3 & 3) << 4 | (brick.y >> 3 & 3) << 2 |
                                  (brick.x >> 3 & 3));
}

}  // namespace cuboid_mapping
