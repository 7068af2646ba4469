// SPDX-License-Identifier: BSD-3-Clause
// Example:
//     FreeBoxesTask task;
//     task.max_boxes = 3;
//     task.may_overlap = true;
//     const auto free = findFreeBoxes(map, task, Budget::unlimited());
//     for (const CellBox& box : free.value.boxes) std::cout << box << '\n';
#pragma once

#include "cuboid_mapping/boxes/box_cover.h"

#include <cstddef>
#include <vector>

namespace cuboid_mapping {

/// Request of findFreeBoxes().
struct FreeBoxesTask {
  std::size_t max_boxes = 0;   ///< Maximum number of boxes, > 0.
  CellBox region = kAllCells;  ///< Boxes stay inside.
  bool may_overlap = false;    ///< Whether two boxes may share voxels.
};

/// Boxes of findFreeBoxes().
struct FreeBoxes {
  std::vector<CellBox> boxes;      ///< In the order in which the search took them.
  double covered_volume_m3 = 0.0;  ///< Volume of the boxes, each voxel counted once.
  double missing_volume_m3 = 0.0;  ///< Volume of the free voxels of the region in no box.
};

/// A few boxes of free voxels that hold much of the free space of a region.
///
/// The largest joined cuboids grow until each face meets a voxel that is not free, or, without may_overlap,
/// that belongs to another box. The search repeatedly takes the box that adds the most volume. With may_overlap
/// this is at least 63 % of the volume of the best choice among the grown boxes (G. Nemhauser, L. Wolsey, M.
/// Fisher, 1978). Deterministic.
///
/// Cases:
///   - nothing is free: kNotFound;
///   - fewer boxes hold all free voxels: these;
///   - the budget is spent: kBudgetSpent, without boxes;
///   - max_boxes is 0, or the region is empty: kInvalid.
///
/// @param budget  Entries are boxes.
/// @complexity O((1000 + n) g) for n boxes and g bricks on the faces of a growing box.
Answer<FreeBoxes> findFreeBoxes(const CuboidMap& map, const FreeBoxesTask& task, Budget& budget);

}  // namespace cuboid_mapping
