// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/rtree/rtree.h"
#include "cuboid_mapping/scan/brick_update.h"

#include <vector>

namespace cuboid_mapping {

/// Voxels that clouds do not change, as disjoint boxes. Const functions may run side by side.
class LockedBoxes {
 public:
  /// Locks the voxels of a box, those that are locked already included. When memory fails, what was
  /// locked stays so. @complexity O((k + 1) log n) for k locked boxes that it meets, as of remove().
  void add(const CellBox& box);
  /// Unlocks the voxels of a box; a locked box that reaches beyond it is cut at its faces. When memory
  /// fails, some of its voxels may stay locked, and no others are unlocked.
  void remove(const CellBox& box);
  void clear() { tree_.clear(); }

  [[nodiscard]] bool isEmpty() const { return tree_.isEmpty(); }
  /// In no particular order.
  [[nodiscard]] std::vector<CellBox> boxes() const;

  /// An update without its locked voxels. @complexity O(log n + k) for each brick, of n locked boxes and
  /// k that it meets.
  [[nodiscard]] std::vector<BrickUpdate> without(const std::vector<BrickUpdate>& update) const;

 private:
  void cut(const std::vector<Cuboid>& locked, const CellBox& box);

  RTree tree_;
};

}  // namespace cuboid_mapping
