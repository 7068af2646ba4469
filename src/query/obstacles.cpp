// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/obstacles.h"

namespace cuboid_mapping {

BrickMask Obstacles::inBrick(const Cell& brick) const {
  VoxelClasses::Masks masks{};
  BrickMask blocked{};
  if (!classes_.find(brick, masks)) {
    if (blocks_unknown_) blocked.fill(~std::uint64_t{0});
    return blocked;
  }
  blocked = *masks.occupied;
  if (!blocks_unknown_) return blocked;
  for (std::size_t z = 0; z < blocked.size(); ++z) blocked[z] |= ~(*masks.known)[z];
  return blocked;
}

bool Obstacles::isAnyInBrick(const Cell& brick, const CellBox& box) const {
  VoxelClasses::Masks masks{};
  if (!classes_.find(brick, masks)) return blocks_unknown_;
  if (masks.is_all_free) return false;
  const CellBox part = intersect(box, brickBox(brick));
  const std::uint64_t slice = sliceMask(part);
  for (std::int32_t z = part.min.z; z < part.max.z; ++z) {
    const auto at = static_cast<std::size_t>(z & 7);
    const std::uint64_t unknown = blocks_unknown_ ? ~(*masks.known)[at] : 0;
    if ((((*masks.occupied)[at] | unknown) & slice) != 0) return true;
  }
  return false;
}

}  // namespace cuboid_mapping
