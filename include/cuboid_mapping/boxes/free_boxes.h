// SPDX-License-Identifier: BSD-3-Clause
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

/// Answer of findFreeBoxes().
struct FreeBoxes {
  BoxesEnd end = BoxesEnd::kInvalid;  ///< Outcome of the search.
  std::vector<CellBox> boxes;      ///< Boxes of kFound, in the order in which the search took them.
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
///   - nothing is free: kFound without boxes;
///   - fewer boxes hold all free voxels: these.
///
/// @param budget  Entries are boxes.
/// @complexity O((1000 + n) g) for n boxes and g bricks on the faces of a growing box.
[[nodiscard]] FreeBoxes findFreeBoxes(const CuboidMap& map, const FreeBoxesTask& task,
                                      Budget& budget = Budget::unlimited());

}  // namespace cuboid_mapping
