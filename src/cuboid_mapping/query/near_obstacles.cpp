// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/near_obstacles.h"

#include <algorithm>

namespace cuboid_mapping {

/// Looks at the bricks around a ball.
void NearObstacles::moveTo(const Ball& ball) {
  const CellBox bounds = ball.bounds();
  const Cell first = brickOf(bounds.min);
  const Cell end = brickOf(bounds.max + Cell{kBrickEdge - 1, kBrickEdge - 1, kBrickEdge - 1});
  corner_ = toVector(first);
  middle_ = half_ = 0.5F * toVector(end - first).cast<float>();
  near_.clear();
  forEachBrick({first, end}, [&](const Cell& brick) {
    const BrickObstacles* found = cache_.find(brick);
    if (found == nullptr || cache_.budget().isSpent()) return;
    const CellBox& box = found->box;
    const Eigen::Vector3f half = 0.5F * toVector(box.size()).cast<float>();
    near_.push_back({toVector(box.min - first).cast<float>() + half, half, *found});
  });
}

/// As findMetInBrick(), the nearest voxel first: a ball that moves leaves it last.
bool NearObstacles::findMetIn(const BrickObstacles& obstacles, const Ball& ball) {
  Cell nearest = ball.centerCell();
  for (int axis = 0; axis < 3; ++axis) {
    nearest[axis] = std::clamp(nearest[axis], obstacles.box.min[axis], obstacles.box.max[axis] - 1);
  }
  const bool is_met =
      obstacles.voxels.test(voxelIndex(nearest)) && ball.meets(Cube::of(nearest, 1.0));
  const std::optional<Cell> met = is_met ? nearest : findMetInBrick(ball, obstacles);
  has_met_ = met.has_value();
  if (met) met_ = *met;
  return has_met_;
}

}  // namespace cuboid_mapping
