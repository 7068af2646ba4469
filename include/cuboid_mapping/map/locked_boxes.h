// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/rtree/rtree.h"
#include "cuboid_mapping/scan/brick_update.h"

#include <set>
#include <vector>

namespace cuboid_mapping {

/// Voxels that clouds do not change, as disjoint boxes. Const functions may run side by side. Where memory
/// fails, a function throws, and the boxes are as before.
class LockedBoxes {
 public:
  /// Locks the voxels of a box, those that are locked already included.
  /// @complexity O((k + 1) log n) for k locked boxes that it meets, as of remove().
  void add(const CellBox& box);
  /// Unlocks the voxels of a box; a locked box that reaches beyond it is cut at its faces.
  void remove(const CellBox& box);
  /// Unlocks everything.
  void clear() noexcept;

  /// Whether no voxel is locked.
  [[nodiscard]] bool isEmpty() const { return boxes_.empty(); }
  /// The locked voxels as disjoint boxes, in no particular order.
  [[nodiscard]] std::vector<CellBox> boxes() const { return {boxes_.begin(), boxes_.end()}; }

  /// An update without its locked voxels. @complexity O(log n + k) for each brick, of n locked boxes and
  /// k that it meets.
  [[nodiscard]] std::vector<BrickUpdate> without(const std::vector<BrickUpdate>& update) const;

 private:
  /// Disjoint boxes have different first cells.
  struct IsBefore {
    bool operator()(const CellBox& a, const CellBox& b) const noexcept { return a.min < b.min; }
  };
  using Boxes = std::set<CellBox, IsBefore>;

  void makeTree();
  void replace(const CellBox& box, Boxes added);
  template <typename VisitorT>
  void visit(const CellBox& box, const VisitorT& visitor) const;

  Boxes boxes_;
  RTree tree_;            ///< Of the boxes.
  bool has_tree_ = true;  ///< Else memory has failed, and the next change makes it anew.
};

}  // namespace cuboid_mapping
