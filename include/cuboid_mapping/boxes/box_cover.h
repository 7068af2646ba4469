// SPDX-License-Identifier: BSD-3-Clause
// Example:
//     CoverTask task;
//     task.max_boxes = 10;
//     const auto cover = coverOccupied(map, task, Budget::unlimited());
//     if (cover.isNotFound()) std::cout << cover.value.boxes.size() << " boxes are needed\n";
//     if (cover.isFound()) std::cout << cover->added_volume_m3 << " m3 more than the obstacles\n";
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/answer.h"
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

/// Cover of coverOccupied().
struct BoxCover {
  std::vector<CellBox> boxes;       ///< Largest first; they may overlap.
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
///   - nothing is occupied: a cover without boxes;
///   - max_boxes suffice for the joined cuboids: these, without added volume;
///   - more than max_boxes are needed, because CoverTask::keep_free lies between the voxels, or because a box
///     around them has more than 2^22 bricks: kNotFound, with as few boxes as the search has found;
///   - max_boxes is 0, or the region is empty: kInvalid.
///
/// @param budget  Entries are boxes.
/// @complexity About O(n log n) box unions for n joined cuboids, each O(bricks of the union).
Answer<BoxCover> coverOccupied(const CuboidMap& map, const CoverTask& task, Budget& budget);

}  // namespace cuboid_mapping
