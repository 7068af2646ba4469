// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/fusion/growing_bricks.h"

#include <map>
#include <vector>

namespace cuboid_mapping {

/// Voxels that leave fused cuboids, which become several (paper, Section VI: a contradicted cell is split at the
/// resolution of the grid).
class CuboidCuts {
 public:
  /// Notes voxels of a brick that leave a cuboid.
  void add(const Cuboid& cuboid, const Cell& brick, const BrickMask& voxels);
  /// Replaces the noted cuboids by their pieces. The voxels that leave are single cells.
  void apply(GrowingBricks& bricks);

 private:
  struct Cut {
    Cuboid cuboid;
    std::vector<Cell> cells;
  };

  std::map<Cell, Cut> cuts_;  ///< By the least cell of the cuboid.
};

}  // namespace cuboid_mapping
