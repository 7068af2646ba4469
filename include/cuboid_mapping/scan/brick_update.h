// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/brick.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace cuboid_mapping {

/// The voxels of one brick that a cloud observes.
struct BrickUpdate {
  Cell brick;        ///< Least cell of the brick.
  BrickMask hits;    ///< Voxels in which a beam ends.
  BrickMask misses;  ///< Voxels that a beam passes; those that are hits, too, count as hits.
  /// Place along the Morton curve; >> 6 names a group of 4 x 4 x 4 bricks.
  std::uint64_t morton = 0;
};

/// What one cloud says about the map: each voxel at most once.
struct ScanUpdate {
  std::vector<BrickUpdate> bricks;   ///< One for each touched brick, in Morton order.
  std::vector<Cell> samples;         ///< Cells drawn along the beams, see BeamSampling.
  std::size_t num_points = 0;        ///< Points and no-returns that took part.
  std::size_t num_out_of_range = 0;  ///< Left out: not finite, or outside the grid.
  std::size_t num_too_far = 0;       ///< Left out: more than kMaxBeamVoxels away.
};

}  // namespace cuboid_mapping
