// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/boxes/voxel_set.h"

#include <cstdint>
#include <limits>
#include <queue>
#include <vector>

namespace cuboid_mapping {

/// Whether a union may be part of a cover: it meets no kept space, and has at most 2^22 bricks, so that voxels
/// far from all others cost no memory.
[[nodiscard]] bool isAllowed(const CellBox& both, const std::vector<CellBox>& keep_free);

/// Unites boxes two by two, at each step two that add the fewest voxels to those that are covered.
///
/// A box knows one partner, the best of those near it, and waits in a queue by what their union would add.
/// Covered voxels only become more, so that a waiting union adds at most what it was queued with. Where
/// there are many boxes, partners are sought in groups of neighbours, which are made anew when half of the
/// boxes are left.
class BoxMerger {
 public:
  /// @param boxes  Disjoint. @param keep_free  Must outlive this object, as the budget.
  BoxMerger(const std::vector<CellBox>& boxes, const std::vector<CellBox>& keep_free,
            Budget& budget);

  /// Unites boxes down to this number, until none may be united, or the budget is spent.
  void mergeTo(std::size_t max_boxes);

  /// The remaining boxes.
  [[nodiscard]] const std::vector<CellBox>& boxes() const { return boxes_; }
  /// Whether any two were united.
  [[nodiscard]] bool hasMerged() const { return has_merged_; }

 private:
  using Index = std::uint32_t;
  static constexpr std::size_t kGroupSize = 1024;
  static constexpr std::size_t kExactPartners = 4;  ///< Whose union is counted voxel by voxel.

  struct Item {
    double num_added;
    Index first;
    Index second;
    /// Of equal ones the union with the lower numbers comes first: the result is deterministic.
    bool operator<(const Item& other) const {
      if (num_added != other.num_added) return num_added > other.num_added;
      return first != other.first ? first > other.first : second > other.second;
    }
  };

  void makeGroups(std::size_t size);
  void splitGroup(std::vector<Index>& group, std::size_t size);
  void findPartner(Index box);
  void mergeInGroups(std::size_t max_boxes);
  void merge(Index first, Index second);
  void removeGone();

  std::vector<CellBox> boxes_;  ///< Empty: gone.
  const std::vector<CellBox>& keep_free_;
  Budget& budget_;
  VoxelSet covered_;
  std::size_t num_left_;
  std::vector<std::vector<Index>> groups_;
  std::vector<Index> group_of_;
  std::priority_queue<Item> queue_;
  bool has_merged_ = false;
};

}  // namespace cuboid_mapping
