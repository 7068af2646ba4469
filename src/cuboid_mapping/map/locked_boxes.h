// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/rtree/inner_tree.h"
#include "cuboid_mapping/scan/brick_update.h"

#include <vector>

namespace cuboid_mapping {

/// Voxels that clouds do not change, as disjoint boxes. Const functions may run side by side. Where memory
/// fails, a function throws, and the boxes are as before.
class LockedBoxes {
 public:
  /// Locks the voxels of a box; some may be locked already.
  /// @complexity O((k + 1) log n) for k locked boxes that it meets; the same for remove().
  void add(const CellBox& box);
  /// Unlocks the voxels of a box; a locked box that reaches beyond it is cut at its faces.
  void remove(const CellBox& box);

  /// Whether no voxel is locked.
  [[nodiscard]] bool isEmpty() const { return tree_.isEmpty(); }
  /// Whether a voxel of a box is locked. @complexity O(log n).
  [[nodiscard]] bool intersects(const CellBox& box) const;
  /// Whether a locked box meets the box around an update: if not, without() changes nothing.
  /// @complexity O(log n + b) for b bricks.
  [[nodiscard]] bool mayMeet(const std::vector<BrickUpdate>& update) const;
  /// The locked voxels as disjoint boxes, ordered by their least cells.
  [[nodiscard]] std::vector<CellBox> boxes() const;

  /// The update without locked voxels. @complexity O(log n + k) for each brick, with n locked boxes and
  /// k of them that meet it.
  [[nodiscard]] std::vector<BrickUpdate> without(const std::vector<BrickUpdate>& update) const;

 private:
  template <typename VisitT>
  void visitMet(const CellBox& box, VisitT visit) const;
  void replace(const CellBox& box, bool is_added);

  InnerTree tree_{RTreeConfig()};  ///< Its leaf nodes are the boxes.
  std::vector<CellBox> boxes_;     ///< By leaf node; empty for a free number.
  std::vector<NodeIndex> free_;    ///< Numbers of no box.
};

}  // namespace cuboid_mapping
