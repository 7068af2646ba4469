// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/cell_box.h"

#include <algorithm>
#include <cstdint>

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

/// The cell of a box that is nearest to a cell. @pre The box is not empty.
[[nodiscard]] inline Cell clampTo(const CellBox& box, const Cell& cell) {
  Cell clamped;
  for (int axis = 0; axis < 3; ++axis) {
    clamped[axis] = std::clamp(cell[axis], box.min[axis], box.max[axis] - 1);
  }
  return clamped;
}

}  // namespace cuboid_mapping
