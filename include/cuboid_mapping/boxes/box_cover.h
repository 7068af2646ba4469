// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/budget.h"

#include <cstddef>
#include <vector>

namespace cuboid_mapping {

/// Request of coverOccupied().
struct CoverTask {
  std::size_t max_boxes = 0;       ///< Maximum number of boxes, > 0.
  CellBox region = kAllCells;      ///< Only voxels inside are covered; boxes stay inside.
  std::vector<CellBox> keep_free;  ///< No box of the answer shares a voxel with one of these.
};

/// Outcome of coverOccupied() and findFreeBoxes().
enum class BoxesEnd : unsigned char {
  kInvalid,  ///< max_boxes is 0, or the region is empty.
  kFound,    ///< There is an answer.
  /// max_boxes are not enough: CoverTask::keep_free lies between the voxels, or they are so far apart that a
  /// box around them has more than 2^22 bricks.
  kTooFewBoxes,
  kBudgetSpent,  ///< The budget was spent before there was an answer.
};

/// Answer of coverOccupied().
struct BoxCover {
  BoxesEnd end = BoxesEnd::kInvalid;  ///< Outcome of the search.
  /// Boxes, largest first; they may overlap. With kTooFewBoxes: more than max_boxes, the fewest that were
  /// found. With kInvalid and kBudgetSpent: none.
  std::vector<CellBox> boxes;
  double occupied_volume_m3 = 0.0;  ///< Volume of the occupied voxels in the boxes.
  double added_volume_m3 = 0.0;     ///< Volume of all other voxels in the boxes, each counted once.
  double left_out_volume_m3 = 0.0;  ///< Volume of occupied voxels of the region inside keep_free.
};

/// Covers the occupied voxels of a region by a few boxes that add little volume, for planners that take
/// boxes only.
///
/// The search unites the two joined cuboids that add the least volume, again and again; then it splits single
/// boxes and unites others in exchange while this lessens the added volume. The least possible volume is not
/// guaranteed: the problem is NP-hard. Deterministic.
///
/// Cases:
///   - nothing is occupied: kFound without boxes;
///   - as many boxes as joined cuboids: these, nothing is added.
///
/// @param budget  Limits the bricks to look at and, as entries, the boxes.
/// @complexity About O(n log n) box unions for n joined cuboids, each O(bricks of the union).
[[nodiscard]] BoxCover coverOccupied(const CuboidMap& map, const CoverTask& task,
                                     Budget& budget = Budget::unlimited());

}  // namespace cuboid_mapping
