// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/query/budget.h"
#include "cuboid_mapping/query/unknown_policy.h"

#include <optional>
#include <vector>

namespace cuboid_mapping {

/// Which cuboids a box query returns.
enum class CuboidOutput : unsigned char {
  kNone,     ///< Only volumes and classes.
  kWhole,    ///< Every cuboid that shares a voxel with the box, as it is in the map.
  kClipped,  ///< The parts inside the box.
};

/// Content of a box.
struct BoxQueryResult {
  CellBox box;  ///< The voxels that the asked box overlaps: all figures are for these.
  double free_volume_m3 = 0.0;      ///< Volume of its free voxels.
  double occupied_volume_m3 = 0.0;  ///< Volume of its occupied voxels.
  double unknown_volume_m3 = 0.0;   ///< Volume of all other voxels.
  std::vector<Cuboid> cuboids;      ///< The cuboids that CuboidOutput asks for, in any order.

  /// Occupied if any voxel is; else unknown if any is; else free.
  [[nodiscard]] Occupancy occupancy() const;
};

/// Volumes by class, and cuboids of a box in metres, map frame. For probabilities see value_query.h.
///
/// Cases:
///   - every voxel that the box overlaps counts as a whole: the answer is conservative, and the volumes add up
///     to that of `BoxQueryResult::box`;
///   - space outside the map is unknown;
///   - inverted, flat (max <= min), NaN, or out of the grid's range: nothing;
///   - the budget is spent: all voxels count as unknown, or cuboids are missing.
///
/// @param budget  Entries are cuboids.
/// @complexity O(bricks of the box, or all known bricks if these are fewer); with cuboids as
/// visitBox(), too.
[[nodiscard]] std::optional<BoxQueryResult> queryBox(const CuboidMap& map, const MetricBox& box_map,
                                                     CuboidOutput output = CuboidOutput::kNone,
                                                     CuboidFilter filter = CuboidFilter::kAll,
                                                     Budget& budget = Budget::unlimited());

/// As above for a box of voxels; an empty one has no volume.
/// @param filter  Selects the returned cuboids; the volumes count all voxels.
[[nodiscard]] BoxQueryResult queryBox(const CuboidMap& map, const CellBox& box,
                                      CuboidOutput output = CuboidOutput::kNone,
                                      CuboidFilter filter = CuboidFilter::kAll,
                                      Budget& budget = Budget::unlimited());

/// Whether a box in metres, map frame, has no obstacle: every voxel that it overlaps is free, or unknown if the
/// policy is kPass. Stops at the first obstacle.
///
/// Also false if there is no answer: queryBox() refuses the box, or the budget is spent.
/// @complexity O(bricks of the box).
[[nodiscard]] bool isFree(const CuboidMap& map, const MetricBox& box_map, UnknownPolicy policy,
                          Budget& budget = Budget::unlimited());

/// Whether any voxel of the box is occupied; stops at the first.
/// @complexity O(bricks of the box) for up to 64 * 512 voxels, else as visitBox() for occupied cuboids.
[[nodiscard]] bool isAnyOccupied(const CuboidMap& map, const CellBox& box);

}  // namespace cuboid_mapping
