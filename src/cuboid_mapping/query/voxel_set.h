// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/query/budget.h"
#include "cuboid_mapping/voxels/brick_table.h"

#include <vector>

namespace cuboid_mapping {

/// A set of voxels, by brick. Once the budget is spent, bricks are neither added nor removed, nor counted in a box.
class VoxelSet {
 public:
  /// The voxels of some boxes. @param budget  Counts bricks that are read. Must outlive the set.
  explicit VoxelSet(Budget& budget, const std::vector<CellBox>& boxes = {}) : budget_(&budget) {
    for (const CellBox& box : boxes) add(box);
  }

  /// Adds voxels.
  ///@{
  void add(const CellBox& box) {
    cuboid_mapping::forEachBrick(box, [&](const Cell& brick) {
      if (budget_->spend()) add(brick, partOf(box, brick));
    });
  }
  void add(const Cell& brick, const BrickMask& voxels) {
    if (voxels.isEmpty()) return;
    Item& item = items_.findOrAdd(brick);
    set(item, item.voxels | voxels);
  }
  ///@}
  /// Removes voxels.
  void remove(const CellBox& box) {
    cuboid_mapping::forEachBrick(box, [&](const Cell& brick) {
      if (!budget_->spend()) return;
      if (Item* item = items_.find(brick)) set(*item, item->voxels.without(partOf(box, brick)));
    });
  }

  /// Voxels of the set in a box.
  [[nodiscard]] double count(const CellBox& box) const {
    double sum = 0.0;
    visit(box, [&](const Item& item, const CellBox& part) {
      const bool is_whole = part == brickBox(item.brick);
      sum += is_whole ? item.count : (item.voxels & BrickMask::ofBox(part)).count();
    });
    return sum;
  }
  /// The voxels of the set in a brick.
  [[nodiscard]] BrickMask inBrick(const Cell& brick) const {
    const Item* item = items_.find(brick);
    return item == nullptr ? BrickMask() : item->voxels;
  }
  /// Number of voxels of the set.
  [[nodiscard]] double size() const {
    double sum = 0.0;
    items_.forEach([&](const Item& item) { sum += item.count; });
    return sum;
  }
  /// Whether all voxels of a box are in the set.
  [[nodiscard]] bool contains(const CellBox& box) const {
    return !anyBrick(box, [&](const Cell& brick) {
      const Item* item = items_.find(brick);
      return !budget_->spend() || item == nullptr || !item->voxels.contains(partOf(box, brick));
    });
  }
  /// Calls visit(brick, mask) for the voxels of the set, in no particular order.
  template <typename VisitorT>
  void forEachBrick(VisitorT visit_mask) const {
    items_.forEach([&](const Item& item) {
      if (!item.voxels.isEmpty()) visit_mask(item.brick, item.voxels);
    });
  }
  /// As above, for the voxels of the set in a box.
  template <typename VisitorT>
  void forEachBrickIn(const CellBox& box, VisitorT visit_mask) const {
    visit(box, [&](const Item& item, const CellBox& part) {
      const BrickMask voxels = item.voxels & BrickMask::ofBox(part);
      if (!voxels.isEmpty()) visit_mask(item.brick, voxels);
    });
  }

 private:
  struct Item {
    Cell brick;
    BrickMask voxels;
    int count = 0;
  };

  template <typename VisitorT>
  void visit(const CellBox& box, VisitorT visit_part) const {
    items_.visitIn(box, [&](const Item& item) {
      if (!budget_->spend()) return Visit::kStop;
      visit_part(item, intersect(box, brickBox(item.brick)));
      return Visit::kContinue;
    });
  }
  [[nodiscard]] static BrickMask partOf(const CellBox& box, const Cell& brick) {
    return BrickMask::ofBox(intersect(box, brickBox(brick)));
  }
  static void set(Item& item, const BrickMask& voxels) {
    item.voxels = voxels;
    item.count = voxels.count();
  }

  BrickTable<Item> items_;
  Budget* budget_;
};

}  // namespace cuboid_mapping
