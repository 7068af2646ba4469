// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/cell.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <ostream>

namespace cuboid_mapping {

/// Axis-aligned box of voxels, half-open: it holds the cells with min <= cell < max on every axis,
/// so that a shared face belongs to exactly one of two neighbours.
struct CellBox {
  Cell min;  ///< Least cell, inside.
  Cell max;  ///< One beyond the greatest cell on every axis, outside.

  /// The box of one voxel.
  [[nodiscard]] static constexpr CellBox ofCell(const Cell& cell) {
    return {cell, {cell.x + 1, cell.y + 1, cell.z + 1}};
  }

  /// True when no cell is inside, also when min > max on some axis.
  [[nodiscard]] constexpr bool isEmpty() const {
    return min.x >= max.x || min.y >= max.y || min.z >= max.z;
  }

  /// Edge lengths in voxels; only meaningful for a box that is not empty.
  [[nodiscard]] constexpr Cell size() const { return max - min; }

  /// Number of voxels, 0 for an empty box. Exact up to 2^53.
  [[nodiscard]] constexpr double numVoxels() const {
    return isEmpty() ? 0.0
                     : (static_cast<double>(max.x) - min.x) * (static_cast<double>(max.y) - min.y) *
                           (static_cast<double>(max.z) - min.z);
  }

  /// Whether min <= cell < max on every axis.
  [[nodiscard]] constexpr bool contains(const Cell& cell) const {
    return min.x <= cell.x && cell.x < max.x && min.y <= cell.y && cell.y < max.y &&
           min.z <= cell.z && cell.z < max.z;
  }

  /// True when every cell of `other` is inside; an empty box is inside every box.
  [[nodiscard]] constexpr bool contains(const CellBox& other) const {
    return other.isEmpty() ||
           (min.x <= other.min.x && other.max.x <= max.x && min.y <= other.min.y &&
            other.max.y <= max.y && min.z <= other.min.z && other.max.z <= max.z);
  }

  /// True when the boxes share at least one cell; touching faces are not enough.
  /// @pre neither box is empty.
  [[nodiscard]] constexpr bool intersects(const CellBox& other) const {
    return min.x < other.max.x && other.min.x < max.x && min.y < other.max.y &&
           other.min.y < max.y && min.z < other.max.z && other.min.z < max.z;
  }
};

/// Whether the corners are equal. Two empty boxes may have different corners.
///@{
constexpr bool operator==(const CellBox& a, const CellBox& b) {
  return a.min == b.min && a.max == b.max;
}
constexpr bool operator!=(const CellBox& a, const CellBox& b) { return !(a == b); }
///@}

/// The cells that are in both boxes; empty when there are none.
[[nodiscard]] constexpr CellBox intersect(const CellBox& a, const CellBox& b) {
  return {{std::max(a.min.x, b.min.x), std::max(a.min.y, b.min.y), std::max(a.min.z, b.min.z)},
          {std::min(a.max.x, b.max.x), std::min(a.max.y, b.max.y), std::min(a.max.z, b.max.z)}};
}

/// Minimum bounding box of two boxes that are not empty.
[[nodiscard]] constexpr CellBox unite(const CellBox& a, const CellBox& b) {
  return {{std::min(a.min.x, b.min.x), std::min(a.min.y, b.min.y), std::min(a.min.z, b.min.z)},
          {std::max(a.max.x, b.max.x), std::max(a.max.y, b.max.y), std::max(a.max.z, b.max.z)}};
}

/// Up to six disjoint boxes, as `subtract` returns them.
class BoxPieces {
 public:
  /// Appends a box. @pre size() < 6.
  void add(const CellBox& box) {
    assert(size_ < static_cast<int>(boxes_.size()));
    boxes_[static_cast<std::size_t>(size_++)] = box;
  }
  /// Number of boxes, 0 to 6.
  [[nodiscard]] int size() const { return size_; }
  /// The boxes in the order in which they were added.
  ///@{
  [[nodiscard]] const CellBox* begin() const { return boxes_.data(); }
  [[nodiscard]] const CellBox* end() const { return boxes_.data() + size_; }
  ///@}

 private:
  std::array<CellBox, 6> boxes_;
  int size_ = 0;
};

/// The cells of `box` that are not in `hole`, as at most six disjoint boxes.
///
/// Cases:
///   - no common cell: `box` itself, in one piece (none if `box` is empty);
///   - `hole` covers `box`: no piece;
///   - else: one slab for each face of `box` that `hole` does not reach, cut along z, y, x.
[[nodiscard]] inline BoxPieces subtract(const CellBox& box, const CellBox& hole) {
  BoxPieces pieces;
  if (box.isEmpty()) return pieces;
  const CellBox common = intersect(box, hole);
  if (common.isEmpty()) {
    pieces.add(box);
    return pieces;
  }
  CellBox rest = box;
  for (int axis = 2; axis >= 0; --axis) {
    if (rest.min[axis] < common.min[axis]) {
      CellBox below = rest;
      below.max[axis] = common.min[axis];
      pieces.add(below);
      rest.min[axis] = common.min[axis];
    }
    if (common.max[axis] < rest.max[axis]) {
      CellBox above = rest;
      above.min[axis] = common.max[axis];
      pieces.add(above);
      rest.max[axis] = common.max[axis];
    }
  }
  return pieces;
}

/// Writes "[(x y z) (x y z))": least cell, and one beyond the greatest.
inline std::ostream& operator<<(std::ostream& out, const CellBox& box) {
  return out << '[' << box.min << ' ' << box.max << ')';
}

}  // namespace cuboid_mapping
