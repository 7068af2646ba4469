// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/budget.h"

#include <cstddef>
#include <vector>

namespace cuboid_mapping {

/// Request of coverOccupied().
struct CoverTask {
  std::size_t max_boxes = 0;       ///< > 0.
  CellBox region = kAllCells;      ///< Occupied voxels outside are not covered; boxes stay inside.
  std::vector<CellBox> keep_free;  ///< No box of the answer shares a voxel with one of these.
};

/// How coverOccupied() and findFreeBoxes() have ended.
enum class BoxesEnd : unsigned char {
  kInvalid,  ///< max_boxes is 0, or the region is empty.
  kFound,    ///< There is an answer.
  /// max_boxes are not enough: CoverTask::keep_free lies between the voxels, or they are so far apart that a
  /// box around them has more than 2^22 bricks.
  kTooFewBoxes,
  kBudgetSpent,  ///< Before there was an answer.
};

/// Answer of coverOccupied().
struct BoxCover {
  BoxesEnd end = BoxesEnd::kInvalid;  ///< Whether there is an answer.
  /// Largest first; they may overlap. With kTooFewBoxes more than max_boxes, as few as were found; with
  /// kInvalid and kBudgetSpent none.
  std::vector<CellBox> boxes;
  double occupied_volume_m3 = 0.0;  ///< Volume of the occupied voxels in the boxes.
  double added_volume_m3 = 0.0;     ///< Volume of all other voxels in the boxes, each counted once.
  double left_out_volume_m3 = 0.0;  ///< Volume of occupied voxels of the region inside keep_free.
};

/// Covers the occupied voxels of a region by a few boxes that add little volume, for planners that take
/// boxes only.
///
/// Joined cuboids are united two by two, at each step those that add the least; then single boxes are split
/// and others united in exchange, as long as this lessens the added volume. The least possible volume is not
/// guaranteed: the problem is NP-hard. Deterministic.
///
/// Cases:
///   - nothing is occupied: kFound without boxes;
///   - as many boxes as joined cuboids: these, nothing is added.
///
/// @param budget  Bricks that are looked at; entries are boxes.
/// @complexity About O(n log n) box unions for n joined cuboids, each O(bricks of the union).
[[nodiscard]] BoxCover coverOccupied(const CuboidMap& map, const CoverTask& task,
                                     Budget& budget = Budget::unlimited());

}  // namespace cuboid_mapping
