// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/obstacles.h"

#include "cuboid_mapping/query/voxel_set.h"

namespace cuboid_mapping {

BrickMask Obstacles::inBrick(const Cell& brick) const {
  return more_ == nullptr ? ofMap(brick) : ofMap(brick) | more_->inBrick(brick);
}

BrickMask Obstacles::ofMap(const Cell& brick) const {
  const PackedVoxels* voxels = voxels_.find(brick);
  if (voxels == nullptr) return blocks_unknown_ ? BrickMask::all() : BrickMask();
  if (!blocks_unknown_) return voxels->occupied();
  return voxels->isAllFree() ? BrickMask() : voxels->occupied() | ~voxels->known();
}

CellBox Obstacles::partWithAny(const CellBox& box) const {
  if (blocks_unknown_ || more_ != nullptr) return box;
  return intersect(box, map_.bounds().value_or(CellBox()));
}

bool Obstacles::isAnyInBrick(const Cell& brick, const CellBox& box) const {
  if (more_ != nullptr &&
      more_->inBrick(brick).intersects(BrickMask::ofBox(intersect(box, brickBox(brick))))) {
    return true;
  }
  const PackedVoxels* voxels = voxels_.find(brick);
  if (voxels == nullptr) return blocks_unknown_;
  if (blocks_unknown_ ? voxels->isAllFree() : !voxels->isAnyOccupied()) return false;
  return inBrick(brick).intersects(BrickMask::ofBox(intersect(box, brickBox(brick))));
}

}  // namespace cuboid_mapping
