// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/scan/brick_update.h"

#include <vector>

namespace cuboid_mapping {

/// Voxels that clouds do not change, as disjoint boxes. Const functions may run side by side.
class LockedBoxes {
 public:
  /// Locks the voxels of a box, those that are locked already included.
  void add(const CellBox& box);
  /// Unlocks the voxels of a box; a locked box that reaches beyond it is cut at its faces.
  void remove(const CellBox& box);
  void clear() { boxes_.clear(); }

  [[nodiscard]] const std::vector<CellBox>& boxes() const { return boxes_; }

  /// An update without its locked voxels. @complexity O(locked boxes) for each brick.
  [[nodiscard]] std::vector<BrickUpdate> without(const std::vector<BrickUpdate>& update) const;

 private:
  std::vector<CellBox> boxes_;
};

}  // namespace cuboid_mapping
