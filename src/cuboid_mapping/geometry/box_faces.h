// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/brick_mask.h"
#include "cuboid_mapping/geometry/cell_box.h"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace cuboid_mapping {

/// The slab outside a face of a box. @param face  Axis, plus 3 for the upper face.
[[nodiscard]] constexpr CellBox slabBeyond(const CellBox& box, int face,
                                           std::int32_t thickness = 1) {
  const int axis = face % 3;
  CellBox slab = box;
  slab.min[axis] = face < 3 ? box.min[axis] - thickness : box.max[axis];
  slab.max[axis] = face < 3 ? box.min[axis] : box.max[axis] + thickness;
  return slab;
}

/// The box with more cells around it on all sides.
[[nodiscard]] constexpr CellBox dilate(const CellBox& box, const Cell& by = {1, 1, 1}) {
  return {box.min - by, box.max + by};
}

/// The boxes without the cells of the holes.
[[nodiscard]] inline std::vector<CellBox> subtractAll(std::vector<CellBox> boxes,
                                                      const std::vector<CellBox>& holes) {
  for (const CellBox& hole : holes) {
    std::vector<CellBox> left;
    for (const CellBox& box : boxes) {
      for (const CellBox& piece : subtract(box, hole)) left.push_back(piece);
    }
    boxes.swap(left);
  }
  return boxes;
}

/// The voxel that holds a point given in voxels. @pre It is in the range of cells.
[[nodiscard]] inline Cell floorOf(const Eigen::Vector3d& point) {
  return {static_cast<std::int32_t>(std::floor(point.x())),
          static_cast<std::int32_t>(std::floor(point.y())),
          static_cast<std::int32_t>(std::floor(point.z()))};
}

/// The cell of a box that is nearest to a cell. @pre The box is not empty.
[[nodiscard]] inline Cell clampTo(const CellBox& box, const Cell& cell) {
  Cell clamped;
  for (int axis = 0; axis < 3; ++axis) {
    clamped[axis] = std::clamp(cell[axis], box.min[axis], box.max[axis] - 1);
  }
  return clamped;
}

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
