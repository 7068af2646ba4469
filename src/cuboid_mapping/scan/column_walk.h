// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/cell_box.h"
#include "cuboid_mapping/scan/beam_marks.h"
#include "cuboid_mapping/scan/face_beams.h"
#include "cuboid_mapping/scan/plane_columns.h"

#include <functional>
#include <vector>

namespace cuboid_mapping {

/// Marks the voxels that the beams of a face pass, plane by plane, with one look at each column instead of one
/// at each beam. Gives the voxels of walkRay(), bit for bit:
///
///   - A beam passes slabs k and k + 1 in the column where it crosses plane k. So all columns that some beam
///     crosses at plane k are marked in both slabs. That is all the beam passes in slab k if it crosses at most
///     one border across there.
///   - If it crosses two, from column (i, j) to (i + 1, j + 1), it passes one of the two columns between as
///     well. Where one of the two is not marked yet, and columns (i, j) at plane k - 1 and (i + 1, j + 1) at
///     plane k are, the beams near that corner are looked at one by one.
///   - A column counts as crossed only if a beam crosses it further than walkMargin() from its borders, or all
///     beams of a bin do: then walkRay() takes that beam through it, whatever the rounding. If there is only a
///     beam nearer to a border, or one whose order of two borders is that close, walkRay() takes this beam. Its
///     columns are marked by itself, so that it need not be known which they are.
///   - A beam is in the face of its longest axis only, so that it crosses at most one border of each other axis
///     in a slab. One with a slope of 1 may cross one just at a plane, which is near a border.
///   - What a beam passes in its last slab is up to CloudFaces, which puts no beam that ends near a border into a
///     face.
///   - At plane -1 all beams are in the origin's column, whatever their slopes. Borders next to the origin are taken
///     as walkRay() has them, so that the error of a place grows from there with the depth. So a beam from an origin
///     on a border leaves it in slab 0 for certain, unless it runs along it.
class ColumnWalk {
 public:
  /// Walks beam `end` as walkRay() does, up to slab `last_slab` at least.
  using WalkBeam = std::function<void(std::uint32_t end, int last_slab, BeamMarks& marks)>;

  /// @param start  The origin's voxel minus the base, see toBrickKey().
  ColumnWalk(const FaceBeams& beams, const Cell& start, WalkBeam walk_beam, BeamMarks& marks)
      : beams_(beams),
        face_(beams.face()),
        start_(start),
        walk_beam_(std::move(walk_beam)),
        marks_(marks) {}

  /// Marks slabs `first` to `last`: of slab `last`, the columns at plane last - 1 only. With first = 0 to last
  /// = n, all voxels of beams that end before slab n, and of others those before slab n.
  void mark(int first, int last);

 private:
  /// Bins of a row or a column of columns.
  struct Span {
    int first, last;              ///< All bins that overlap it.
    int first_whole, last_whole;  ///< Bins inside it.
  };
  /// Nodes of the pyramid that overlap a tile, and which of them a beam crosses the plane in: a word for each
  /// row of nodes.
  struct TileNodes {
    int level;
    int x, y;  ///< The first node.
    std::array<std::uint64_t, 64> reached;
  };
  /// A step from a column at plane k - 1 to one at plane k, over two borders.
  struct Corner {
    int plane;
    std::array<int, 2> column;
    std::array<int, 2> step;
  };

  void findColumns(int plane, PlaneColumns& crossed);
  [[nodiscard]] std::vector<Span> spansAt(double depth, int first_tile, int num_tiles,
                                          std::size_t across) const;
  /// @param columns, rows  Eight of each.
  [[nodiscard]] std::uint64_t findInTile(int plane, int level, const Span* columns,
                                         const Span* rows, const std::array<int, 2>& tile);
  [[nodiscard]] bool isCrossed(int plane, const TileNodes& nodes, const Span& column_span,
                               const Span& row_span, const std::array<int, 2>& column);
  void markSlab(int slab, const PlaneColumns& entered, const PlaneColumns& left);
  void markCorners(int plane, const PlaneColumns& entered, const PlaneColumns& left);
  void markCorner(const Corner& corner, bool needs_right, bool needs_up);
  [[nodiscard]] BrickMask& missesAt(int slab, int tile_x, int tile_y);
  void markVoxel(int slab, int x, int y) {
    missesAt(slab, x >> 3, y >> 3)[static_cast<std::size_t>(alongAt(slab) & 7)] |=
        std::uint64_t{1} << (8 * (y & 7) + (x & 7));
  }
  [[nodiscard]] std::int32_t alongAt(int slab) const {
    return start_[face_.axis] + (face_.is_down ? -slab : slab);
  }

  const FaceBeams& beams_;
  const Face& face_;
  Cell start_;
  WalkBeam walk_beam_;
  BeamMarks& marks_;
  std::vector<std::uint32_t> unsure_;  ///< Beams near a border of the current column.
};

}  // namespace cuboid_mapping
