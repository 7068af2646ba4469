// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/boxes/cover_cost.h"

#include <cstdint>
#include <queue>
#include <vector>

namespace cuboid_mapping {

/// Voxels of the union that lie in neither box; other boxes may cover some of them.
[[nodiscard]] double countOutside(const CellBox& a, const CellBox& b);

/// Number of boxes that are compared with another one in about the time of a brick.
constexpr std::size_t kBoxesPerBrick = 256;

/// Whether a union may be part of a cover: it meets no kept space, and has at most 2^22 bricks, so that
/// remote voxels cost no memory. Not when the budget is spent.
[[nodiscard]] bool isAllowed(const CellBox& both, const std::vector<CellBox>& keep_free,
                             Budget& budget);

/// The union of two boxes, and the boxes that it does not contain.
[[nodiscard]] std::vector<CellBox> withUnion(const std::vector<CellBox>& boxes,
                                             const CellBox& both);

/// Unites boxes two by two; each step unites the two at the least cost of the voxels that they add.
///
/// Each box has one partner, the best of those near it, and waits in a queue ordered by the cost of their union.
/// Covered voxels only increase, so a waiting union costs at most as much as when it was queued.
/// With many boxes, partners are sought in groups of neighbours, which are rebuilt when half of the boxes are
/// left.
class BoxMerger {
 public:
  /// @param keep_free  Must outlive this object, as must cost and budget.
  /// @param may_take  Asked about the boxes with each union; empty: all may be taken.
  BoxMerger(const std::vector<CellBox>& boxes, const std::vector<CellBox>& keep_free,
            const CoverCost& cost, Budget& budget, CoverTest may_take = {});

  /// Unites boxes until this number is reached, no union is allowed, or the budget is spent.
  void mergeTo(std::size_t max_boxes);

  /// The remaining boxes.
  [[nodiscard]] const std::vector<CellBox>& boxes() const { return boxes_; }
  /// Whether any two were united.
  [[nodiscard]] bool hasMerged() const { return has_merged_; }

 private:
  using Index = std::uint32_t;
  static constexpr std::size_t kGroupSize = 1024;
  static constexpr std::size_t kExactPartners = 4;  ///< Partners counted voxel by voxel.

  struct Item {
    double cost;
    Index first;
    Index second;
    /// On a tie, the union with the lower numbers comes first: the result is deterministic.
    bool operator<(const Item& other) const {
      if (cost != other.cost) return cost > other.cost;
      return first != other.first ? first > other.first : second > other.second;
    }
  };

  void makeGroups(std::size_t size);
  void splitGroup(std::vector<Index>& group, std::size_t size);
  void findPartner(Index box);
  void mergeInGroups(std::size_t max_boxes);
  [[nodiscard]] bool mayUnite(const CellBox& both);
  void merge(Index first, Index second);
  void removeGone();

  std::vector<CellBox> boxes_;  ///< Empty boxes were removed.
  const std::vector<CellBox>& keep_free_;
  const CoverCost& cost_;
  Budget& budget_;
  CoverTest may_take_;
  std::vector<CellBox> refused_;  ///< Unions that may_take_ refused.
  VoxelSet covered_;
  std::size_t num_left_;
  std::vector<std::vector<Index>> groups_;
  std::vector<Index> group_of_;
  std::priority_queue<Item> queue_;
  bool has_merged_ = false;
};

}  // namespace cuboid_mapping
