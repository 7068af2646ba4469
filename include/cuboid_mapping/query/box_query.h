// SPDX-License-Identifier: BSD-3-Clause
// Example:
//     Budget budget(QueryLimits{0.01});
//     const auto box = queryBox(map, {{0.5, 0.5, 0.2}, {1.5, 1.5, 0.8}}, budget);  // Metres.
//     if (box.isFound() && box->occupancy() == Occupancy::kFree) std::cout << "room to turn\n";
//     const auto cells = queryCells(map, {{5, 5, 2}, {15, 15, 8}}, budget);  // Voxels.
//     std::cout << cells.value.free_volume_m3 << " m3 are free\n";
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/answer.h"
#include "cuboid_mapping/query/budget.h"
#include "cuboid_mapping/query/unknown_policy.h"

namespace cuboid_mapping {

/// Content of a box.
struct BoxQueryResult {
  CellBox box;  ///< The voxels that the asked box overlaps: all figures are for these.
  double free_volume_m3 = 0.0;      ///< Volume of its free voxels.
  double occupied_volume_m3 = 0.0;  ///< Volume of its occupied voxels.
  double unknown_volume_m3 = 0.0;   ///< Volume of all other voxels.

  /// Occupied if any voxel is; else unknown if any is; else free.
  [[nodiscard]] Occupancy occupancy() const;
};

/// Volumes by class of a box in metres, map frame. For its cuboids see cuboid_query.h, for probabilities value_query.h.
///
/// Cases:
///   - every voxel that the box overlaps counts as a whole: the answer is conservative, and the volumes add up
///     to that of `BoxQueryResult::box`;
///   - space outside the map is unknown;
///   - inverted, flat (max <= min), NaN, or out of the grid's range: kInvalid;
///   - kBudgetSpent: all voxels of the value count as unknown.
///
/// @complexity O(bricks of the box, or all known bricks if these are fewer).
Answer<BoxQueryResult> queryBox(const CuboidMap& map, const MetricBox& box_map, Budget& budget);

/// As queryBox(), for a box of voxels; an empty one has no volume.
Answer<BoxQueryResult> queryCells(const CuboidMap& map, const CellBox& box, Budget& budget);

/// Whether a box in metres, map frame, has no obstacle: every voxel that it overlaps is free, or unknown if the
/// policy is kFree. Stops at the first obstacle.
///
/// Also false if there is no answer: queryBox() refuses the box, or the budget is spent.
/// @complexity O(bricks of the box; with kFree, of its part in the bounds of the map if these are fewer).
[[nodiscard]] bool isFree(const CuboidMap& map, const MetricBox& box_map, UnknownPolicy policy,
                          Budget& budget);

/// Whether any voxel of the box is occupied; stops at the first.
/// @complexity O(bricks of the box) for up to 64 * 512 voxels, else as visitBox() for occupied cuboids.
[[nodiscard]] bool isAnyOccupied(const CuboidMap& map, const CellBox& box);

}  // namespace cuboid_mapping
