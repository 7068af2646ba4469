// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/budget.h"
#include "cuboid_mapping/query/unknown_policy.h"
#include "cuboid_mapping/query/way_answer.h"

#include <cstddef>
#include <optional>
#include <vector>

namespace cuboid_mapping {

/// First obstacle that a box meets while it moves along a path.
struct PathContact {
  std::size_t segment = 0;    ///< Number of the waypoint that the segment starts from.
  double distance_m = 0.0;    ///< Length of the free part of the path.
  Eigen::Vector3d point_map;  ///< Centre of the box there.
  Cell voxel;                 ///< A voxel that the box meets there.
};

/// Answer of checkPath().
struct PathQueryResult {
  WayAnswer answer = WayAnswer::kInvalid;  ///< Whether the whole path is free.
  double length_m = 0.0;  ///< Length of the whole path; 0 for kInvalid and kBudgetSpent.
  std::optional<PathContact> contact;  ///< The contact of kBlocked.

  /// Whether the whole path was checked, and nothing is in the way.
  [[nodiscard]] bool isFree() const { return answer == WayAnswer::kFree; }
};

/// Sweeps a box along the straight segments between waypoints, its faces parallel to the axes of
/// the map, its centre on the path, and finds the first place where it meets an obstacle.
///
/// Exact for every straight motion, whatever its direction: a voxel is met when the moving box
/// overlaps it by more than 1e-6 voxels, as in Grid::toCellBox; touching faces do not count.
///
/// Cases:
///   - one waypoint: the box standing there, as segment 0 of no length;
///   - it starts in an obstacle: contact in segment 0 at distance 0;
///   - no waypoints, a number that is not finite, an edge that is not > 0, or a waypoint from
///     which the box reaches out of the grid's range: kInvalid;
///   - the budget is spent: kBudgetSpent.
///
/// @param size_m  Edges of the box.
/// @complexity O(bricks swept, and voxels in the way near them).
[[nodiscard]] PathQueryResult checkPath(const CuboidMap& map,
                                        const std::vector<Eigen::Vector3d>& waypoints_map,
                                        const Eigen::Vector3d& size_m, UnknownPolicy policy,
                                        Budget& budget = Budget::unlimited());

/// Whether checkPath() answers kFree. Faster for blocked paths: ends at any contact, not the first one.
[[nodiscard]] bool isPathFree(const CuboidMap& map,
                              const std::vector<Eigen::Vector3d>& waypoints_map,
                              const Eigen::Vector3d& size_m, UnknownPolicy policy,
                              Budget& budget = Budget::unlimited());

/// The box of this size around a point.
[[nodiscard]] inline MetricBox boxAround(const Eigen::Vector3d& center_m,
                                         const Eigen::Vector3d& size_m) {
  return {center_m - 0.5 * size_m, center_m + 0.5 * size_m};
}

}  // namespace cuboid_mapping
