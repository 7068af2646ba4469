// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/budget.h"
#include "cuboid_mapping/query/unknown_policy.h"

#include <optional>

namespace cuboid_mapping {

/// The point nearest to a given one at which a box fits between the obstacles: its centre, with the faces
/// parallel to the axes of the map.
///
/// Exact, also between places on the grid: the box fits where it overlaps no obstacle voxel by more than 1e-6
/// voxels.
///
/// Cases:
///   - it fits at the point itself: that point;
///   - no such place within max_distance_m, an argument that is not finite, an edge that is not
///     > 0, max_distance_m < 0, or places beyond the grid's range: nothing;
///   - the budget is spent: nothing.
///
/// @complexity O(bricks within the distance of the answer, or within max_distance_m if there is none), a few
/// microseconds each.
[[nodiscard]] std::optional<Eigen::Vector3d> findNearestFit(
    const CuboidMap& map, const Eigen::Vector3d& point_map, const Eigen::Vector3d& size_m,
    UnknownPolicy policy, double max_distance_m, Budget& budget = Budget::unlimited());

}  // namespace cuboid_mapping
