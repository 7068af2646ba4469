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

BrickUpdate LockedBoxes::without(const BrickUpdate& update) const {
  BrickUpdate rest = update;
  for (const CellBox& locked : boxes_) {
    const CellBox part = intersect(locked, brickBox(update.brick));
    if (part.isEmpty()) continue;
    const std::uint64_t kept = ~sliceMask(part);
    for (std::int32_t z = part.min.z; z < part.max.z; ++z) {
      rest.hits[static_cast<std::size_t>(z & 7)] &= kept;
      rest.misses[static_cast<std::size_t>(z & 7)] &= kept;
    }
  }
  return rest;
}

}  // namespace cuboid_mapping
