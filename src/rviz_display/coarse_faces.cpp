// SPDX-License-Identifier: BSD-3-Clause
#include "coarse_faces.h"

namespace cuboid_mapping_rviz {
namespace {

using namespace cuboid_mapping;

/// Bits 0, 2, 4... of a number, next to each other.
std::uint32_t everySecondBit(std::uint32_t bits) {
  bits &= 0x55555555U;
  bits = (bits | bits >> 1) & 0x33333333U;
  bits = (bits | bits >> 2) & 0x0f0f0f0fU;
  bits = (bits | bits >> 4) & 0x00ff00ffU;
  return (bits | bits >> 8) & 0x0000ffffU;
}

/// The lowest run of ones. @pre There is one.
std::uint32_t lowestRun(std::uint32_t bits) {
  const std::uint32_t lowest = bits & -bits;
  return bits & ~(bits + lowest);
}

}  // namespace

void CoarseCells::setColumns() {
  columns_ = {};
  for (int z = 0; z < size_; ++z) {
    for (int y = 0; y < size_; ++y) {
      for (std::uint32_t left = cells_[at(z)][at(y)]; left != 0; left &= left - 1) {
        columns_[at(__builtin_ctz(left))][at(z)] |= 1U << y;
      }
    }
  }
}

void CoarseCells::add(const Cell& brick, const BrickMask& voxels) {
  const Cell first{brick.x / 2, brick.y / 2, brick.z / 2};
  constexpr std::uint64_t kCell = 0x0303;  // 2 x 2 voxels of a slice
  for (int z = 0; z < kBrickEdge / 2; ++z) {
    const std::uint64_t upper = voxels[2 * z + 1];
    const std::uint64_t any = voxels[2 * z] | upper;
    if (any == 0) continue;
    for (int y = 0; y < kBrickEdge / 2; ++y) {
      const auto two_rows = static_cast<std::uint32_t>(any >> (16 * y) & 0xffff);
      const std::uint32_t row = two_rows | two_rows >> 8;
      const std::uint32_t cells = everySecondBit((row | row >> 1) & 0x55U);
      cells_[at(first.z + z)][at(first.y + y)] |= cells << first.x;
      for (std::uint32_t left = cells; left != 0; left &= left - 1) {
        const int x = __builtin_ctz(left);
        const std::uint64_t cell = kCell << (16 * y + 2 * x);
        const int columns = __builtin_popcountll(any & cell);
        const int high = __builtin_popcountll(upper & cell);
        top(first.x + x, first.y + y, first.z + z) =
            static_cast<std::uint8_t>(8 * (columns + high) / columns);
      }
    }
  }
}

/// Mean top of the 2 x 2 x 2 cells from a least cell on.
std::uint8_t CoarseCells::meanTop(int x, int y, int z) const {
  int sum = 0;
  int columns = 0;
  for (const int dy : {0, 1}) {
    for (const int dx : {0, 1}) {
      const bool is_high = isSet(x + dx, y + dy, z + 1);
      if (!is_high && !isSet(x + dx, y + dy, z)) continue;
      sum += is_high ? 8 * edge_ + top(x + dx, y + dy, z + 1) : top(x + dx, y + dy, z);
      ++columns;
    }
  }
  return static_cast<std::uint8_t>(sum / columns);
}

void CoarseCells::coarsen() {
  for (int z = 0; z < size_ / 2; ++z) {
    Rows rows{};
    for (int y = 0; y < size_ / 2; ++y) {
      const std::uint32_t row = cells_[at(2 * z)][at(2 * y)] | cells_[at(2 * z)][at(2 * y + 1)] |
                                cells_[at(2 * z + 1)][at(2 * y)] |
                                cells_[at(2 * z + 1)][at(2 * y + 1)];
      rows[at(y)] = everySecondBit(row | row >> 1);
      for (std::uint32_t left = rows[at(y)]; left != 0; left &= left - 1) {
        const int x = __builtin_ctz(left);
        top(x, y, z) = meanTop(2 * x, 2 * y, 2 * z);  // Reads cells that are not overwritten yet.
      }
    }
    cells_[at(z)] = rows;
  }
  size_ /= 2;
  edge_ *= 2;
}

CoarseCells::Rows CoarseCells::exposed(int side, int plane) const {
  const int axis = side / 2;
  const auto cells_of = [&](int i, int row) {
    if (axis == 0) return columns_[at(i)][at(row)];
    return axis == 1 ? cells_[at(row)][at(i)] : cells_[at(i)][at(row)];
  };
  const int next = plane + (side % 2 == 0 ? -1 : 1);
  const bool is_covered = next >= 0 && next < size_;
  Rows seen{};
  for (int row = 0; row < size_; ++row) {
    seen[at(row)] = cells_of(plane, row) & ~(is_covered ? cells_of(next, row) : 0U);
  }
  return seen;
}

void CoarseCells::appendPlane(int side, int plane, std::vector<FaceVertex>& vertices) const {
  Rows rows = exposed(side, plane);
  const int axis = side / 2;
  const int bit_axis = axis == 0 ? 1 : 0;
  const int row_axis = axis == 2 ? 1 : 2;
  for (int i = 0; i < size_; ++i) {
    while (rows[at(i)] != 0) {
      const std::uint32_t run = lowestRun(rows[at(i)]);
      int end = i;
      while (end < size_ && (rows[at(end)] & run) == run) rows[at(end++)] &= ~run;
      CellBox cells{{plane, plane, plane}, {plane + 1, plane + 1, plane + 1}};
      cells.min[bit_axis] = __builtin_ctz(run);
      cells.max[bit_axis] = 32 - __builtin_clz(run);
      cells.min[row_axis] = i;
      cells.max[row_axis] = end;
      appendRectangle(side, cells, vertices);
    }
  }
}

void CoarseCells::appendRectangle(int side, const CellBox& cells,
                                  std::vector<FaceVertex>& vertices) const {
  const auto to_voxels = [&](const Cell& cell) {
    return Cell{edge_ * cell.x, edge_ * cell.y, edge_ * cell.z};
  };
  appendFace({to_voxels(cells.min), to_voxels(cells.max)}, side, {}, vertices);
  if (side != 5) return;
  for (auto vertex = vertices.end() - 4; vertex != vertices.end(); ++vertex) {
    // The cell at this corner.
    const int x = vertex->cell[0] / edge_ - (vertex->cell[0] / edge_ == cells.max.x ? 1 : 0);
    const int y = vertex->cell[1] / edge_ - (vertex->cell[1] / edge_ == cells.max.y ? 1 : 0);
    vertex->size = static_cast<std::uint8_t>(8 * edge_ - top(x, y, cells.min.z));
  }
}

FaceMesh::Part CoarseCells::appendFaces(std::vector<FaceVertex>& vertices) {
  setColumns();
  FaceMesh::Part part;
  part.first = vertices.size() / 4;
  part.is_coarse = true;
  for (std::size_t i = 0; i < kSideOrder.size(); ++i) {
    if (kSideOrder[i] != kSliceSide) {
      for (int plane = 0; plane < size_; ++plane) appendPlane(kSideOrder[i], plane, vertices);
    }
    part.ends[i] = vertices.size() / 4 - part.first;
  }
  return part;
}

}  // namespace cuboid_mapping_rviz
