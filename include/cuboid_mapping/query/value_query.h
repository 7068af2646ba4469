// SPDX-License-Identifier: BSD-3-Clause
// Example:
//     const CellBox box{{19, 0, 0}, {21, 1, 1}};
//     const auto mean = meanProbability(map, box, Budget::unlimited());
//     const auto greatest = maxLogOdds(map, box, Budget::unlimited());
//     if (mean.isFound()) std::cout << *mean << " on average, " << *greatest << " at most\n";
//
// Log-odds of voxels: a cuboid itself has a class only.
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/answer.h"
#include "cuboid_mapping/query/budget.h"

namespace cuboid_mapping {

/// Calls visit(float log_odds, int num_voxels) for the known voxels of a box: for each log-odds in each brick,
/// the number of its voxels in the box. @return false: the budget is spent, and some were not visited.
/// @complexity O(bricks of the box, or all known bricks if these are fewer).
template <typename VisitorT>
bool visitValues(const CuboidMap& map, const CellBox& box, Budget& budget, VisitorT visit) {
  if (box.isEmpty()) return true;
  const Visit end = map.voxels().visitIn(box, [&](const VoxelBrick& brick) {
    if (!budget.spend()) return Visit::kStop;
    const BrickMask part = BrickMask::ofBox(intersect(box, brickBox(brick.brick)));
    brick.voxels.forEachValue([&](float log_odds, const BrickMask& voxels) {
      if (const int count = (voxels & part).count(); count > 0) visit(log_odds, count);
    });
    return Visit::kContinue;
  });
  return end == Visit::kContinue;
}

/// Mean probability of the known voxels of a box, of a cuboid for instance; kNotFound when none is known.
/// @complexity As visitValues().
Answer<double> meanProbability(const CuboidMap& map, const CellBox& box, Budget& budget);

/// Greatest log-odds of the known voxels of a box; kNotFound when none is known. @complexity As visitValues().
Answer<float> maxLogOdds(const CuboidMap& map, const CellBox& box, Budget& budget);

}  // namespace cuboid_mapping
