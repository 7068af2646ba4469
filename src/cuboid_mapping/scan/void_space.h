// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/brick.h"
#include "cuboid_mapping/geometry/voxel_motion.h"
#include "cuboid_mapping/scan/brick_update.h"

#include <cstddef>
#include <unordered_map>

namespace cuboid_mapping {

/// Voxels in which nothing can be that stands still, because they were certainly empty once: what is in them
/// before or after has moved. After DUFOMap (Duberg, Zhang, Jia and Jensfelt, 2024), cloud by cloud.
///
/// A voxel becomes void by one cloud whose beams pass it and pass all of its 26 neighbours, and end in none of them. The
/// neighbours see to it that neither a pose or a range that is slightly wrong, nor a beam that grazes a surface, makes
/// the surface void. Once void, always void. Not thread-safe.
class VoidSpace {
 public:
  /// Takes what a cloud observes. @complexity O(bricks of the update).
  void add(const ScanUpdate& update);

  /// The void voxels of a brick.
  [[nodiscard]] BrickMask of(const Cell& brick) const {
    const auto found = bricks_.find(brick);
    return found == bricks_.end() ? BrickMask() : found->second;
  }
  /// Whether a voxel is void.
  [[nodiscard]] bool contains(const Cell& cell) const {
    return of(brickOf(cell)).test(voxelIndex(cell));
  }

  /// What a cloud says without its hits in void voxels, which are then no observation at all.
  [[nodiscard]] ScanUpdate withoutMoving(const ScanUpdate& update) const;

  /// The same in another frame. @complexity O(void voxels).
  [[nodiscard]] VoidSpace moved(const VoxelMotion& motion) const;

  /// Calls visit(brick, mask) for each brick with void voxels, in no order.
  template <typename VisitorT>
  void forEach(VisitorT visit) const {
    for (const auto& [brick, mask] : bricks_) visit(brick, mask);
  }

 private:
  std::unordered_map<Cell, BrickMask, CellHash> bricks_;
};

}  // namespace cuboid_mapping
