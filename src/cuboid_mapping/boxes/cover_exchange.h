// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/boxes/cover_cost.h"

#include <optional>
#include <utility>
#include <vector>

namespace cuboid_mapping {

/// Reduces the cost of a cover: shrinks each box to the voxels that no other box covers, and splits one
/// box if two others can be united for less.
class CoverExchange {
 public:
  /// @param occupied  The covered voxels. Must outlive this object, as must keep_free, cost and budget.
  /// @param may_take  Asked about each cover of less cost; empty: all may be taken.
  CoverExchange(const VoxelSet& occupied, std::vector<CellBox> boxes,
                const std::vector<CellBox>& keep_free, const CoverCost& cost, Budget& budget,
                CoverTest may_take = {})
      : occupied_(occupied),
        keep_free_(keep_free),
        cost_(cost),
        budget_(budget),
        may_take_(std::move(may_take)),
        boxes_(std::move(boxes)),
        cost_of_boxes_(costOf(boxes_)) {}

  /// Exchanges until the cost no longer falls, at most max_boxes times, or until the budget is spent.
  void improve(std::size_t max_boxes);

  /// The current cover.
  [[nodiscard]] const std::vector<CellBox>& boxes() const { return boxes_; }

 private:
  static constexpr std::size_t kMostBoxes = 1000;  ///< Larger covers take too long to exchange.
  static constexpr std::size_t kTriedSplits = 6;
  static constexpr std::size_t kExactUnions = 8;

  struct Split {
    double num_saved = 0.0;
    std::size_t box = 0;
    CellBox lower;
    CellBox upper;
  };

  [[nodiscard]] double costOf(const std::vector<CellBox>& boxes) const;
  /// @return Bounds of the covered voxels of a box that lie in no other box; nothing if there are none.
  [[nodiscard]] std::optional<CellBox> findOwn(const std::vector<CellBox>& boxes,
                                               std::size_t box) const;
  template <typename VisitorT>
  void forEachOwn(const std::vector<CellBox>& boxes, std::size_t box, VisitorT visit) const;
  [[nodiscard]] std::vector<CellBox> shrink(std::vector<CellBox> boxes) const;
  [[nodiscard]] std::vector<Split> findSplits() const;
  [[nodiscard]] Split findSplit(std::size_t box) const;
  [[nodiscard]] std::vector<CellBox> findUnions(const std::vector<CellBox>& boxes) const;
  bool tryExchange(const Split& split, std::size_t max_boxes);
  bool takeIfBetter(std::vector<CellBox> boxes);

  const VoxelSet& occupied_;
  const std::vector<CellBox>& keep_free_;
  const CoverCost& cost_;
  Budget& budget_;
  CoverTest may_take_;
  std::vector<CellBox> boxes_;
  double cost_of_boxes_;
};

}  // namespace cuboid_mapping
