// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/budget.h"
#include "cuboid_mapping/query/unknown_policy.h"

#include <optional>

namespace cuboid_mapping {

class VoxelSet;

/// The obstacles of a map: occupied voxels, and unknown ones if the policy is kObstacle. Each call reads the
/// current map. Between two bricks, its searches let others get their turn at the map; they end when the budget
/// is spent. Not thread-safe, because of the budget.
class Obstacles {
 public:
  /// @param budget  Must outlive this object. @param more  Obstacles beside those of the map; may be null.
  Obstacles(const CuboidMap& map, UnknownPolicy policy, Budget& budget,
            const VoxelSet* more = nullptr)
      : map_(map),
        voxels_(map.voxels()),
        budget_(budget),
        more_(more),
        blocks_unknown_(policy == UnknownPolicy::kObstacle) {}

  /// The obstacles of a brick. @param brick  Its least cell. @complexity O(1) on average.
  [[nodiscard]] BrickMask inBrick(const Cell& brick) const;

  /// The part of a box beyond which it has no obstacle: if unknown space is free, that in the bounds of the map.
  [[nodiscard]] CellBox partWithAny(const CellBox& box) const;

  /// Whether any voxel of a box is an obstacle; true when the budget is spent.
  /// @complexity O(bricks of the box, or of its partWithAny() if these are fewer).
  [[nodiscard]] bool isAny(const CellBox& box) const {
    // Looking up the bricks of a smaller box takes less time than the bounds do.
    constexpr double kSmall = 64.0 * kBrickVoxels;
    return anyBrick(box.numVoxels() > kSmall ? partWithAny(box) : box, [&](const Cell& brick) {
      return !budget_.spendAndUnlock() || isAnyInBrick(brick, box);
    });
  }

  /// Visits the obstacles in a box. @param visit  (const Cell&). @complexity O(bricks of its partWithAny(), and
  /// obstacles).
  template <typename VisitorT>
  void visit(const CellBox& box, VisitorT visit) const {
    (void)anyBrick(partWithAny(box), [&](const Cell& brick) {
      const BrickMask part = BrickMask::ofBox(intersect(box, brickBox(brick)));
      forEachCell(brick, inBrick(brick) & part, visit);
      return !budget_.spendAndUnlock();
    });
  }

  /// An obstacle in a box; nothing if it has none, or the budget is spent before. @complexity As isAny().
  [[nodiscard]] std::optional<Cell> findAny(const CellBox& box) const {
    std::optional<Cell> found;
    (void)anyBrick(partWithAny(box), [&](const Cell& brick) {
      const BrickMask part = BrickMask::ofBox(intersect(box, brickBox(brick)));
      forEachCell(brick, inBrick(brick) & part, [&](const Cell& voxel) {
        if (!found) found = voxel;
      });
      return found || !budget_.spendAndUnlock();
    });
    return found;
  }

  /// Budget of the searches above.
  [[nodiscard]] Budget& budget() const { return budget_; }

 private:
  [[nodiscard]] bool isAnyInBrick(const Cell& brick, const CellBox& box) const;
  [[nodiscard]] BrickMask ofMap(const Cell& brick) const;

  const CuboidMap& map_;
  const VoxelStore& voxels_;
  Budget& budget_;
  const VoxelSet* more_;
  bool blocks_unknown_;
};

}  // namespace cuboid_mapping
