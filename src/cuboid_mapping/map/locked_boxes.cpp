// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/locked_boxes.h"

namespace cuboid_mapping {

void LockedBoxes::remove(const CellBox& box) {
  std::vector<CellBox> rest;
  for (const CellBox& locked : boxes_) {
    const BoxPieces pieces = subtract(locked, box);
    rest.insert(rest.end(), pieces.begin(), pieces.end());
  }
  boxes_ = std::move(rest);
}

void LockedBoxes::add(const CellBox& box) {
  remove(box);
  if (!box.isEmpty()) boxes_.push_back(box);
}

std::vector<BrickUpdate> LockedBoxes::without(const std::vector<BrickUpdate>& update) const {
  std::vector<BrickUpdate> rest = update;
  for (BrickUpdate& brick : rest) {
    for (const CellBox& locked : boxes_) {
      const CellBox part = intersect(locked, brickBox(brick.brick));
      if (part.isEmpty()) continue;
      const BrickMask kept = ~BrickMask::ofBox(part);
      brick.hits &= kept;
      brick.misses &= kept;
    }
  }
  return rest;
}

}  // namespace cuboid_mapping
