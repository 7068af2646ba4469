// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/fusion/grown_bricks.h"
#include "cuboid_mapping/occupancy/cuboid_filter.h"
#include "cuboid_mapping/voxels/voxel_store.h"

#include <array>
#include <vector>

namespace cuboid_mapping {

/// Thresholds beyond which voxels may fuse, in log-odds (paper, conditions (7) and (8)).
struct FusionThresholds {
  float alpha_min;  ///< Free voxels at or below this one.
  float alpha_max;  ///< Occupied voxels at or above this one.
};

/// A brick while cells grow.
struct GrowingBrick : GrownBrick {
  const PackedVoxels* voxels;          ///< The voxels after the change; maybe none is known.
  std::array<BrickMask, 2> stable;     ///< Voxels beyond the thresholds: free, occupied ones.
  BrickMask held_voxels;               ///< The voxels of `held`.
  BrickMask starters;                  ///< Least cells of the cuboids in the paper's set T.
  BrickMask tried;                     ///< Least cells of cuboids that could not grow in this pass.
  bool has_other_cuboids = false;      ///< Whether `cuboids` differ from those before.
  bool has_other_held_voxels = false;  ///< Whether `held` differs from that before.

  /// Voxels of a class beyond its threshold.
  [[nodiscard]] const BrickMask& stableOf(Occupancy occupancy) const {
    return stable[occupancy == Occupancy::kOccupied ? 1 : 0];
  }
};

/// Working copies of the bricks that a change looks at, so that readers can go on: those that change
/// are copied at once, others when they are first needed.
/// Not thread-safe.
class GrowingBricks {
 public:
  /// @param grown  State before the change. @param voxels  Voxels before the change, too.
  /// @param change  Change of the voxels. All must outlive the object.
  GrowingBricks(const GrownBricks& grown, const VoxelStore& voxels,
                const VoxelStore::PendingChange& change, const FusionThresholds& thresholds);

  /// The copy of a brick. @throws std::bad_alloc
  GrowingBrick& at(const Cell& brick) {
    GrowingBrick*& recent = recent_[indexInGroup(brick)];
    if (recent == nullptr || recent->brick != brick) recent = &findOrCopy(brick);
    return *recent;
  }

  /// Whether all voxels of a box are in a class, beyond its threshold, and not held.
  [[nodiscard]] bool isAllFusible(const CellBox& box, Occupancy occupancy);
  /// The cuboid that holds a known voxel: a fused one, or a single cell.
  [[nodiscard]] Cuboid cuboidAt(const Cell& cell);
  /// Calls visit(const Cuboid&) -> Visit for each fused cuboid that shares a voxel with a box, once.
  template <typename VisitT>
  void visitFused(const CellBox& box, VisitT visit) {
    (void)anyBrick(box, [&](const Cell& brick) {
      for (const Cuboid& cuboid : at(brick).cuboids) {
        const CellBox part = intersect(cuboid.box, box);
        if (part.isEmpty() || brickOf(part.min) != brick) continue;
        if (visit(cuboid) == Visit::kStop) return true;
      }
      return false;
    });
  }
  /// Adds a fused cuboid. @pre Its voxels are single cells.
  void add(const Cuboid& cuboid);
  /// Removes a fused cuboid: its voxels are single cells then.
  void remove(const CellBox& box);

  /// Calls visit(GrowingBrick&) for each copy.
  template <typename VisitT>
  void forEach(VisitT visit) {
    copies_.forEach(visit);
  }

 private:
  GrowingBrick& findOrCopy(const Cell& brick);
  GrowingBrick& copy(const Cell& brick, const PackedVoxels* voxels);

  const GrownBricks& grown_;
  const VoxelStore& voxels_;
  FusionThresholds thresholds_;
  BrickTable<GrowingBrick> copies_;
  /// The last copies found, which saves a hash look-up.
  std::array<GrowingBrick*, kGroupBricks> recent_{};
};

}  // namespace cuboid_mapping
