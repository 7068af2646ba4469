// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/unknown_policy.h"

namespace cuboid_mapping {

/// The voxels of a map that are in the way: the occupied ones, and the unknown ones if the policy
/// is kStop. A view, valid as long as the map does not change. Thread-safe: const.
class Obstacles {
 public:
  Obstacles(const CuboidMap& map, UnknownPolicy policy)
      : classes_(map.classes()), blocks_unknown_(policy == UnknownPolicy::kStop) {}

  /// @complexity O(1).
  [[nodiscard]] BrickMask inBrick(const Cell& brick) const;

  /// Whether any voxel of a box is in the way. @complexity O(bricks of the box).
  [[nodiscard]] bool isAny(const CellBox& box) const {
    return anyBrick(box, [&](const Cell& brick) { return isAnyInBrick(brick, box); });
  }

  /// Visits the voxels in the way. @param visit  (const Cell&).
  template <typename VisitorT>
  void visit(const CellBox& box, VisitorT visit) const {
    (void)anyBrick(box, [&](const Cell& brick) {
      const CellBox part = intersect(box, brickBox(brick));
      const BrickMask blocked = inBrick(brick);
      for (std::int32_t z = part.min.z; z < part.max.z; ++z) {
        std::uint64_t voxels = blocked[static_cast<std::size_t>(z & 7)] & sliceMask(part);
        for (; voxels != 0; voxels &= voxels - 1) {
          const int bit = __builtin_ctzll(voxels);
          visit(Cell{brick.x + (bit & 7), brick.y + (bit >> 3), z});
        }
      }
      return false;  // On to the next brick.
    });
  }

 private:
  [[nodiscard]] bool isAnyInBrick(const Cell& brick, const CellBox& box) const;

  const VoxelClasses& classes_;
  bool blocks_unknown_;
};

}  // namespace cuboid_mapping
