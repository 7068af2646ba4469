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
      : voxels_(map.voxels()), blocks_unknown_(policy == UnknownPolicy::kStop) {}

  /// @complexity O(1).
  [[nodiscard]] BrickMask inBrick(const Cell& brick) const;

  /// Whether any voxel of a box is in the way. @complexity O(bricks of the box).
  [[nodiscard]] bool isAny(const CellBox& box) const {
    return anyBrick(box, [&](const Cell& brick) { return isAnyInBrick(brick, box); });
  }

  /// Visits the voxels in the way. @param visit  (const Cell&).
  template <typename VisitorT>
  void visit(const CellBox& box, VisitorT visit) const {
    forEachBrick(box, [&](const Cell& brick) {
      const BrickMask part = BrickMask::ofBox(intersect(box, brickBox(brick)));
      forEachCell(brick, inBrick(brick) & part, visit);
    });
  }

 private:
  [[nodiscard]] bool isAnyInBrick(const Cell& brick, const CellBox& box) const;

  const VoxelStore& voxels_;
  bool blocks_unknown_;
};

}  // namespace cuboid_mapping
