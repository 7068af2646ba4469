// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/locked_boxes.h"

#include "cuboid_mapping/rtree/traversal.h"

#include <new>
#include <utility>

namespace cuboid_mapping {

void LockedBoxes::makeTree() {
  if (has_tree_) return;
  tree_.clear();
  for (const CellBox& box : boxes_) tree_.insert({box, Occupancy::kOccupied});
  has_tree_ = true;
}

/// Puts other boxes in the place of what is locked in a box. The tree says nothing that the boxes do not:
/// it may be lost.
void LockedBoxes::replace(const CellBox& box, Boxes added) {
  makeTree();
  Selection met;
  tree_.select(box, met);
  for (const Cuboid& cuboid : met.cuboids) {
    for (const CellBox& piece : subtract(cuboid.box, box)) added.insert(piece);
  }
  try {
    for (const Cuboid& cuboid : met.cuboids) tree_.remove(cuboid.box);
    for (const CellBox& piece : added) tree_.insert({piece, Occupancy::kOccupied});
  } catch (const std::bad_alloc&) {
    has_tree_ = false;
  }
  for (const Cuboid& cuboid : met.cuboids) boxes_.erase(cuboid.box);
  boxes_.merge(added);
}

void LockedBoxes::add(const CellBox& box) {
  if (!box.isEmpty()) replace(box, {box});
}

void LockedBoxes::remove(const CellBox& box) {
  if (!box.isEmpty()) replace(box, {});
}

void LockedBoxes::clear() noexcept {
  boxes_.clear();
  tree_.clear();
  has_tree_ = true;
}

/// Gives the visitor the locked boxes that share a cell with a box.
template <typename VisitorT>
void LockedBoxes::visit(const CellBox& box, const VisitorT& visitor) const {
  if (!has_tree_) {
    for (const CellBox& locked : boxes_) {
      if (!intersect(locked, box).isEmpty()) visitor(locked);
    }
    return;
  }
  visitBox(tree_, box, CuboidFilter::kAll, [&visitor](const Cuboid& locked) {
    visitor(locked.box);
    return Visit::kContinue;
  });
}

std::vector<BrickUpdate> LockedBoxes::without(const std::vector<BrickUpdate>& update) const {
  std::vector<BrickUpdate> rest = update;
  for (BrickUpdate& brick : rest) {
    const CellBox cells = brickBox(brick.brick);
    visit(cells, [&](const CellBox& locked) {
      const BrickMask kept = ~BrickMask::ofBox(intersect(locked, cells));
      brick.hits &= kept;
      brick.misses &= kept;
      brick.grazes &= kept;
    });
  }
  return rest;
}

}  // namespace cuboid_mapping
