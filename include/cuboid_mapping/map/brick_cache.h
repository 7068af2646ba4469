// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/fusion/dense_brick.h"

#include <array>
#include <cstdint>
#include <list>
#include <memory>
#include <unordered_map>

namespace cuboid_mapping {

/// The decoded bricks of a group.
struct HotGroup {
  Cell group;                                                    ///< Its least cell.
  std::array<std::unique_ptr<DenseBrick>, kGroupBricks> bricks;  ///< Null where not decoded.
  std::uint64_t is_dirty = 0;    ///< Bit per brick: it differs from what is in the R-tree.
  std::uint64_t last_cloud = 0;  ///< That has touched the group.
};

/// The hot bricks: those that clouds have touched lately, decoded into voxels. Knows nothing of the
/// R-tree. Not thread-safe.
class BrickCache {
 public:
  using Groups = std::list<HotGroup>;

  /// The group of this least cell, added when it is new. It becomes the first one.
  HotGroup& touch(const Cell& group, std::uint64_t cloud);
  /// Makes a brick of a group hot, with all its voxels unknown. @pre it is not.
  DenseBrick& add(HotGroup& group, const Cell& brick);
  void remove(const Cell& group);
  /// Drops the bricks that share a cell with a region, dirty or not.
  void remove(const CellBox& region);
  void clear();

  /// All groups, the one that was touched last first.
  [[nodiscard]] Groups& groups() { return groups_; }
  [[nodiscard]] const Groups& groups() const { return groups_; }
  /// Bytes held for bricks and groups.
  [[nodiscard]] std::size_t numBytes() const;

 private:
  Groups groups_;
  std::unordered_map<Cell, Groups::iterator, CellHash> by_cell_;
  std::size_t num_bricks_ = 0;
};

}  // namespace cuboid_mapping
