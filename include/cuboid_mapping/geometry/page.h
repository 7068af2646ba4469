// SPDX-License-Identifier: BSD-3-Clause
// Pages: the parts of a map that a window loads and evicts.
#pragma once

#include "cuboid_mapping/geometry/cell_box.h"

#include <cstdint>

namespace cuboid_mapping {

/// Edge in voxels of a page: an aligned cube of 8 x 8 x 8 bricks, named by its least cell.
constexpr std::int32_t kPageEdge = 64;

/// Least cell of the page that holds a cell.
[[nodiscard]] constexpr Cell pageOf(const Cell& cell) {
  return {cell.x & ~(kPageEdge - 1), cell.y & ~(kPageEdge - 1), cell.z & ~(kPageEdge - 1)};
}

/// The voxels of a page as a cell box.
[[nodiscard]] constexpr CellBox pageBox(const Cell& page) {
  return {page, {page.x + kPageEdge, page.y + kPageEdge, page.z + kPageEdge}};
}

/// Number of pages that share a cell with a box. Exact up to 2^53.
[[nodiscard]] constexpr double numPages(const CellBox& box) {
  double count = box.isEmpty() ? 0.0 : 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    count *= ((box.max[axis] - 1) >> 6) - (box.min[axis] >> 6) + 1.0;
  }
  return count;
}

}  // namespace cuboid_mapping
