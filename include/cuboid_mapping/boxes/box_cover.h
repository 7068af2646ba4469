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
  kFound,    ///< The search has an answer.
  /// coverOccupied() needs more than max_boxes: CoverTask::keep_free lies between the voxels, or a box around
  /// them has more than 2^22 bricks.
  kTooFewBoxes,
  kBudgetSpent,  ///< The budget was spent before there was an answer.
};

/// Answer of coverOccupied().
struct BoxCover {
  BoxesEnd end = BoxesEnd::kInvalid;  ///< Outcome of the search.
  /// Boxes, largest first; they may overlap. With kTooFewBoxes: more than max_boxes, as few as the search has
  /// found. With kInvalid and kBudgetSpent: none.
  std::vector<CellBox> boxes;
  double occupied_volume_m3 = 0.0;  ///< Volume of the occupied voxels in the boxes.
  double added_volume_m3 = 0.0;     ///< Volume of all other voxels in the boxes, each counted once.
  double left_out_volume_m3 = 0.0;  ///< Volume of occupied voxels of the region inside keep_free.
};

/// Covers the occupied voxels of a region by a few boxes that add little volume, for planners that take boxes
/// only.
///
/// The search repeatedly unites the two boxes that add the least volume, starting with the joined cuboids.
/// Then, for at most 1000 boxes, it splits one box and unites two others, as long as this lessens the added
/// volume. The volume need not be the least possible: that problem is NP-hard. Deterministic.
///
/// Cases:
///   - nothing is occupied: kFound without boxes;
///   - max_boxes suffice for the joined cuboids: these, without added volume.
///
/// @param budget  Entries are boxes.
/// @complexity About O(n log n) box unions for n joined cuboids, each O(bricks of the union).
[[nodiscard]] BoxCover coverOccupied(const CuboidMap& map, const CoverTask& task,
                                     Budget& budget = Budget::unlimited());

}  // namespace cuboid_mapping
