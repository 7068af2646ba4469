// SPDX-License-Identifier: BSD-3-Clause
// Log-odds of voxels: a cuboid itself has a class only.
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/budget.h"

#include <optional>

namespace cuboid_mapping {

/// Calls visit(float log_odds, int num_voxels) for the known voxels of a box: for each log-odds in each brick,
/// the number of its voxels in the box. Does nothing if the budget does not suffice.
/// @complexity O(bricks of the box, or all known bricks if these are fewer).
template <typename VisitorT>
void visitValues(const CuboidMap& map, const CellBox& box, VisitorT visit,
                 Budget& budget = Budget::unlimited()) {
  if (box.isEmpty() || !budget.spend(map.voxels().countLooks(box))) return;
  map.voxels().forEachIn(box, [&](const VoxelBrick& brick) {
    const BrickMask part = BrickMask::ofBox(intersect(box, brickBox(brick.brick)));
    brick.voxels.forEachValue([&](float log_odds, const BrickMask& voxels) {
      if (const int count = (voxels & part).count(); count > 0) visit(log_odds, count);
    });
  });
}

/// Mean probability of the known voxels of a box, of a cuboid for instance; nothing when none is
/// known. Cases and complexity as visitValues().
[[nodiscard]] std::optional<double> meanProbability(const CuboidMap& map, const CellBox& box,
                                                    Budget& budget = Budget::unlimited());

/// Greatest log-odds of the known voxels of a box; nothing when none is known. Cases and
/// complexity as visitValues().
[[nodiscard]] std::optional<float> maxLogOdds(const CuboidMap& map, const CellBox& box,
                                              Budget& budget = Budget::unlimited());

}  // namespace cuboid_mapping
