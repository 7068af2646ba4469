// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/fusion/growing_bricks.h"
#include "cuboid_mapping/geometry/cell_box.h"
#include "cuboid_mapping/scan/brick_update.h"
#include "cuboid_mapping/voxels/voxel_store.h"

#include <array>
#include <vector>

namespace cuboid_mapping {

/// A face of a cell through which it may expand: S_i^x, S_i^-x, ... of the paper (Section IV-B).
struct SearchDirection {
  int axis;  ///< 0, 1, 2: x, y, z.
  int sign;  ///< 1 or -1.
};

/// All six search directions, in the order of trial.
using SearchDirections = std::array<SearchDirection, 6>;

/// The order of Figure 5, lines 1 to 6: +x +y +z -x -y -z for a cube; else the axes by decreasing width (ties in
/// the order x, y, z), first all upwards, then all downwards. @param width  Width of the cell in voxels (w_i).
[[nodiscard]] SearchDirections paperDirections(const Cell& width);

/// The voxels that an expansion adds to a cell: the expanded box without the box.
/// @param depth  Voxels of the expansion, > 0.
[[nodiscard]] CellBox slabOf(const CellBox& box, SearchDirection direction, std::int32_t depth);

/// A growing cell. The bricks change only when it stops: until then the absorbed cuboids lie inside its box, which it
/// does not search again.
struct GrowingCell {
  CellBox box;
  Occupancy occupancy;
  std::vector<CellBox> absorbed;  ///< Fused cuboids inside the box.
};

/// Lets a cell absorb the cells inside a slab beside it, if they fill it (6), and are stable in its class (7), (8).
/// @return Whether they do; if not, nothing changes.
bool absorbSlab(const CellBox& slab, GrowingBricks& bricks, GrowingCell& cell);

/// The steps of the paper's fusion that can be read in other ways, as the paper has them. The evaluation derives others.
class GrowthRules {
 public:
  virtual ~GrowthRules() = default;

  /// The set T of a cloud, in the order of trial: end points of beams, then random cells along them.
  [[nodiscard]] virtual std::vector<Cell> startersOf(const VoxelStore::PendingChange& change,
                                                     const std::vector<BrickUpdate>& observed,
                                                     const std::vector<Cell>& samples) const;
  /// One expansion of a cell (equation 5): by one voxel, in the first of paperDirections() that succeeds.
  /// @return Whether one has succeeded.
  [[nodiscard]] virtual bool expand(GrowingBricks& bricks, GrowingCell& cell) const;
  /// Whether an expansion may reach beyond the next voxel.
  [[nodiscard]] virtual bool reachesFar() const { return false; }
};

}  // namespace cuboid_mapping
