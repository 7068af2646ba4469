// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/budget.h"
#include "cuboid_mapping/query/unknown_policy.h"

namespace cuboid_mapping {

/// The voxels of a map that are in the way: the occupied ones, and the unknown ones if the policy
/// is kStop. A view of the map as it is at each call. isAny() and visit() let others have a turn at the
/// map between two bricks, and end when the budget is spent. Not thread-safe, because of the budget.
class Obstacles {
 public:
  /// @param budget  Must outlive this object.
  Obstacles(const CuboidMap& map, UnknownPolicy policy, Budget& budget = Budget::unlimited())
      : voxels_(map.voxels()), budget_(budget), blocks_unknown_(policy == UnknownPolicy::kStop) {}

  /// The voxels of a brick that are in the way. @param brick  Its least cell. @complexity O(1).
  [[nodiscard]] BrickMask inBrick(const Cell& brick) const;

  /// Whether any voxel of a box is in the way; true when the budget is spent.
  /// @complexity O(bricks of the box).
  [[nodiscard]] bool isAny(const CellBox& box) const {
    return anyBrick(box, [&](const Cell& brick) {
      return !budget_.spendAndYield() || isAnyInBrick(brick, box);
    });
  }

  /// Visits the voxels in the way. @param visit  (const Cell&).
  template <typename VisitorT>
  void visit(const CellBox& box, VisitorT visit) const {
    (void)anyBrick(box, [&](const Cell& brick) {
      const BrickMask part = BrickMask::ofBox(intersect(box, brickBox(brick)));
      forEachCell(brick, inBrick(brick) & part, visit);
      return !budget_.spendAndYield();
    });
  }

  /// Budget of isAny() and visit().
  [[nodiscard]] Budget& budget() const { return budget_; }

 private:
  [[nodiscard]] bool isAnyInBrick(const Cell& brick, const CellBox& box) const;

  const VoxelStore& voxels_;
  Budget& budget_;
  bool blocks_unknown_;
};

}  // namespace cuboid_mapping
