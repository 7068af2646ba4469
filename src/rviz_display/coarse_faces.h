// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "face_mesh.h"

#include "cuboid_mapping/geometry/brick_mask.h"

#include <array>
#include <cstdint>

namespace cuboid_mapping_rviz {

/// Cells of a chunk with edges of 2, 4 or 8 voxels. A cell is in the set if any of its voxels is.
class CoarseCells {
 public:
  /// Adds the voxels of a brick that are drawn, as cells with an edge of 2 voxels.
  /// @param brick  Least cell, relative to the chunk. @pre coarsen() was not called yet.
  void add(const cuboid_mapping::Cell& brick, const cuboid_mapping::BrickMask& voxels);

  /// Makes cells of twice the edge.
  void coarsen();

  /// Appends the sides of cells that no other cell of the chunk covers; touching sides in one plane are joined
  /// to rectangles. Sides between chunks are always appended, because another chunk may be drawn with other
  /// cells. The probability of a vertex is 0. Its size is its height above the voxels in eighths of a voxel,
  /// for upper sides; else 0.
  FaceMesh::Part appendFaces(std::vector<FaceVertex>& vertices);

 private:
  static constexpr int kSize = kChunkEdge / 2;
  using Rows = std::array<std::uint32_t, kSize>;  ///< By y; bit x.

  void setColumns();
  [[nodiscard]] bool isSet(int x, int y, int z) const {
    return (cells_[at(z)][at(y)] >> x & 1) != 0;
  }
  [[nodiscard]] std::uint8_t& top(int x, int y, int z) {
    return tops_[at((z * kSize + y) * kSize + x)];
  }
  [[nodiscard]] std::uint8_t top(int x, int y, int z) const {
    return tops_[at((z * kSize + y) * kSize + x)];
  }
  [[nodiscard]] std::uint8_t meanTop(int x, int y, int z) const;
  /// The visible sides in a plane: rows along one axis, bits along another.
  [[nodiscard]] Rows exposed(int side, int plane) const;
  void appendPlane(int side, int plane, std::vector<FaceVertex>& vertices) const;
  void appendRectangle(int side, const cuboid_mapping::CellBox& cells,
                       std::vector<FaceVertex>& vertices) const;
  static std::size_t at(int index) { return static_cast<std::size_t>(index); }

  int edge_ = 2;                     ///< Edge of a cell, in voxels.
  int size_ = kSize;                 ///< Number of cells along an axis.
  std::array<Rows, kSize> cells_{};  ///< Cells by z.
  /// The same cells by x, then by z; bit y. Made by appendFaces().
  std::array<Rows, kSize> columns_{};
  /// Mean height of the uppermost voxels above the floor of a cell, in eighths of a voxel; by z, y, x.
  std::array<std::uint8_t, std::size_t{kSize} * kSize * kSize> tops_{};
};

}  // namespace cuboid_mapping_rviz
