// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/near_obstacles.h"

#include "cuboid_mapping/geometry/box_faces.h"

namespace cuboid_mapping {

/// Whether the voxel at the centre of a ball is an obstacle: a ball inside of obstacles needs no more.
bool NearObstacles::isMetAtCenter(const Ball& ball) {
  const Cell center = ball.centerCell();
  const BrickObstacles* obstacles = cache_.find(brickOf(center));
  if (obstacles == nullptr || cache_.budget().isSpent()) return false;
  if (!obstacles->voxels.test(voxelIndex(center)) || !ball.meets(Cube::of(center, 1.0))) {
    return false;
  }
  return keep(center) != nullptr;
}

/// Reads the bricks around a ball.
void NearObstacles::moveTo(const Ball& ball) {
  const CellBox bounds = ball.bounds();
  const Cell first = brickOf(bounds.min);
  const Cell end = brickOf(bounds.max + Cell{kBrickEdge - 1, kBrickEdge - 1, kBrickEdge - 1});
  corner_ = toVector(first);
  half_.setConstant(-1.0F);  // Nothing is in the window until all of it is read.
  near_.clear();
  cache_.trim();
  generation_ = cache_.generation();
  free_radius_ = 0.0F;
  forEachBrick({first, end}, [&](const Cell& brick) {
    const BrickObstacles* found = cache_.find(brick);
    if (found == nullptr || cache_.budget().isSpent()) return;
    const CellBox& box = found->box;
    const Eigen::Vector3f half = 0.5F * toVector(box.size()).cast<float>();
    const Eigen::Vector3f center = toVector(box.min - first).cast<float>() + half;
    near_.push_back({center, half, cache_.numberOf(found)});
  });
  if (cache_.budget().isSpent()) return;
  middle_ = half_ = 0.5F * toVector(end - first).cast<float>();
}

/// As findMetInBrick(), but finds the nearest voxel: a moving ball meets it for the longest time.
bool NearObstacles::findMetIn(const BrickObstacles& obstacles, const Ball& ball) {
  const Cell nearest = clampTo(obstacles.box, ball.centerCell());
  const bool is_met =
      obstacles.voxels.test(voxelIndex(nearest)) && ball.meets(Cube::of(nearest, 1.0));
  return keep(is_met ? nearest : findMetInBrick(ball, obstacles)) != nullptr;
}

}  // namespace cuboid_mapping
