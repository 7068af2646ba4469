// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/grower.h"

#include <algorithm>

namespace cuboid_mapping {

void Grower::grow(std::vector<Cell> cells) {
  while (!cells.empty()) {
    for (const Cell& cell : cells) tryCell(cell);
    cells = startersBesideFused();
    for (const Cell& cell : tried_) bricks_.at(brickOf(cell)).tried = {};
    tried_.clear();
    fused_.clear();
  }
}

/// Fuse(g_i) of Figure 5 for the cuboid that holds a cell, as a loop in place of a recursion.
void Grower::tryCell(const Cell& cell) {
  const GrowingBrick& brick = bricks_.at(brickOf(cell));
  const int voxel = voxelIndex(cell);
  const bool is_stable = brick.stable[0].test(voxel) || brick.stable[1].test(voxel);
  if (!is_stable || brick.held_voxels.test(voxel)) return;
  const bool is_fused = brick.fused.test(voxel);
  const Cuboid start = bricks_.cuboidAt(cell);
  GrowingBrick& first = bricks_.at(brickOf(start.box.min));
  first.starters.set(voxelIndex(start.box.min));
  if (first.tried.test(voxelIndex(start.box.min))) return;
  GrowingCell growth{start.box, start.occupancy, {}};
  while (rules_.expand(bricks_, growth)) {
  }
  const Cell& least = growth.box.min;
  GrowingBrick& last = bricks_.at(brickOf(least));
  last.starters.set(voxelIndex(least));
  last.tried.set(voxelIndex(least));
  tried_.push_back(least);
  if (growth.box == start.box) return;
  if (is_fused) bricks_.remove(start.box);
  for (const CellBox& box : growth.absorbed) bricks_.remove(box);
  bricks_.add({growth.box, growth.occupancy});
  fused_.push_back(growth.box);
}

/// Starters that may be able to grow now, because a cell beside them has fused.
std::vector<Cell> Grower::startersBesideFused() {
  std::vector<Cell> cells;
  if (fused_.empty()) return cells;
  if (rules_.reachesFar()) {
    bricks_.forEach([&](const GrowingBrick& brick) {
      forEachCell(brick.brick, brick.starters, [&](const Cell& cell) { cells.push_back(cell); });
    });
    fused_.clear();
  }
  for (const CellBox& box : fused_) {
    const CellBox around = dilate(box);
    forEachBrick(around, [&](const Cell& brick) {
      const GrowingBrick& copy = bricks_.at(brick);
      const BrickMask part = BrickMask::ofBox(intersect(around, brickBox(brick)));
      forEachCell(brick, copy.starters.without(copy.fused) & part,
                  [&](const Cell& cell) { cells.push_back(cell); });
    });
    bricks_.visitFused(around, [&](const Cuboid& cuboid) {
      const Cell& least = cuboid.box.min;
      if (bricks_.at(brickOf(least)).starters.test(voxelIndex(least))) cells.push_back(least);
      return Visit::kContinue;
    });
  }
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  return cells;
}

}  // namespace cuboid_mapping
