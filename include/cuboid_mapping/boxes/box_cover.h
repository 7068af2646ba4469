// SPDX-License-Identifier: BSD-3-Clause
// Example:
//     CoverTask task;
//     task.max_boxes = 10;
//     task.keep_passages_m = {0.6, 0.6, 1.0};  // Doors stay open for this robot.
//     const auto cover = coverOccupied(map, task, Budget::unlimited());
//     if (cover.isNotFound()) std::cout << cover.value.boxes.size() << " boxes are needed\n";
//     if (cover.isFound()) std::cout << cover->added_volume_m3 << " m3 more than the obstacles\n";
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/answer.h"
#include "cuboid_mapping/query/budget.h"

#include <Eigen/Core>

#include <cstddef>
#include <vector>

namespace cuboid_mapping {

/// Request of coverOccupied().
struct CoverTask {
  std::size_t max_boxes = 0;       ///< Maximum number of boxes, > 0.
  CellBox region = kAllCells;      ///< Only voxels inside are covered; boxes stay inside.
  std::vector<CellBox> keep_free;  ///< No box of the answer shares a voxel with one of these.
  /// Edges of a robot's box, which does not turn: what that robot can reach stays reachable, see BoxCover::lost.
  /// All > 0, or all 0: not checked.
  Eigen::Vector3d keep_passages_m = Eigen::Vector3d::Constant(0.5);
  /// Boxes of the last answer. Those that still fit are taken over, at their places in the list.
  std::vector<CellBox> previous;
};

/// Cover of coverOccupied().
struct BoxCover {
  std::vector<CellBox> boxes;  ///< Largest first, or see CoverTask::previous; they may overlap.
  double occupied_volume_m3 = 0.0;  ///< Volume of the occupied voxels in the boxes.
  double added_volume_m3 = 0.0;     ///< Volume of all other voxels in the boxes, each counted once.
  double left_out_volume_m3 = 0.0;  ///< Volume of occupied voxels of the region inside keep_free.
  /// The robot's box in each space that it can reach in the map and no longer beside the boxes; none: all
  /// passages are kept.
  std::vector<CellBox> lost;
};

/// Covers the occupied voxels of a region by a few boxes that add little volume, for planners that take boxes
/// only.
///
/// The search repeatedly unites the two boxes that add the least volume, starting with the joined cuboids.
/// Then, for at most 1000 boxes, it splits one box and unites two others, as long as this lessens the added
/// volume. Known free voxels count twice. The volume need not be the least possible: that problem is NP-hard.
/// Deterministic.
///
/// Passages: the places of the robot between the known free voxels of the region are compared with those beside
/// the boxes. If places that were connected no longer are, the search keeps a way between them free, and begins
/// again; at most 100 boxes are also united only where all stay connected. Unless BoxCover::lost names them, they
/// are connected, or a place at most the robot's edges away is.
///
/// With CoverTask::previous the search begins with those boxes. Its answer is taken if it costs at most a tenth
/// more than that of a search without them.
///
/// Cases:
///   - nothing is occupied: a cover without boxes;
///   - max_boxes suffice for the joined cuboids: these, without added volume;
///   - more than max_boxes are needed, because CoverTask::keep_free lies between the voxels, or because a box
///     around them has more than 2^22 bricks: kNotFound, with as few boxes as the search has found;
///   - max_boxes is 0, the region is empty, or keep_passages_m neither zero nor finite and > 0: kInvalid;
///   - the budget is spent: kBudgetSpent, with the best cover so far, which may close ways that BoxCover::lost does
///     not name; no boxes if there is none yet.
///
/// @param budget  Entries are boxes.
/// @complexity About O(n log n) box unions for n joined cuboids, each O(bricks of the union).
Answer<BoxCover> coverOccupied(const CuboidMap& map, const CoverTask& task, Budget& budget);

}  // namespace cuboid_mapping
