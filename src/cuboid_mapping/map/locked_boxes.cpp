// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/locked_boxes.h"

#include "cuboid_mapping/rtree/traversal.h"

namespace cuboid_mapping {

/// Takes a box out of locked boxes. What is left of one of them is there before it goes, so that nothing
/// is unlocked when memory fails in between.
void LockedBoxes::cut(const std::vector<Cuboid>& locked, const CellBox& box) {
  for (const Cuboid& cuboid : locked) {
    for (const CellBox& piece : subtract(cuboid.box, box)) {
      tree_.insert({piece, Occupancy::kOccupied});
    }
    tree_.remove(cuboid.box);
  }
}

void LockedBoxes::remove(const CellBox& box) {
  Selection met;
  tree_.select(box, met);
  cut(met.cuboids, box);
}

void LockedBoxes::add(const CellBox& box) {
  if (box.isEmpty()) return;
  Selection met;
  tree_.select(box, met);
  tree_.insert({box, Occupancy::kOccupied});
  cut(met.cuboids, box);
}

std::vector<CellBox> LockedBoxes::boxes() const {
  std::vector<CellBox> boxes;
  visitAll(tree_, CuboidFilter::kAll, [&boxes](const Cuboid& cuboid) {
    boxes.push_back(cuboid.box);
    return Visit::kContinue;
  });
  return boxes;
}

std::vector<BrickUpdate> LockedBoxes::without(const std::vector<BrickUpdate>& update) const {
  std::vector<BrickUpdate> rest = update;
  for (BrickUpdate& brick : rest) {
    const CellBox cells = brickBox(brick.brick);
    visitBox(tree_, cells, CuboidFilter::kAll, [&](const Cuboid& locked) {
      const BrickMask kept = ~BrickMask::ofBox(intersect(locked.box, cells));
      brick.hits &= kept;
      brick.misses &= kept;
      return Visit::kContinue;
    });
  }
  return rest;
}

}  // namespace cuboid_mapping
