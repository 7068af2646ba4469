// SPDX-License-Identifier: BSD-3-Clause
// Example:
//     Budget budget(QueryLimits{0.01});
//     const std::vector<Eigen::Vector3d> path{{0.5, 0.5, 0.5}, {3.5, 0.5, 0.5}};
//     const auto contact = checkPath(map, path, {0.5, 0.5, 0.5}, UnknownPolicy::kObstacle, budget);
//     if (contact.isNotFound()) std::cout << "free for " << lengthOf(path) << " m\n";
//     if (contact.isFound()) std::cout << "blocked after " << contact->distance_m << " m\n";
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/answer.h"
#include "cuboid_mapping/query/budget.h"
#include "cuboid_mapping/query/unknown_policy.h"

#include <cstddef>
#include <vector>

namespace cuboid_mapping {

/// First obstacle that a box meets while it moves along a path.
struct PathContact {
  std::size_t segment = 0;  ///< Number of the waypoint that the segment starts from.
  double distance_m = 0.0;  ///< Length of the free part of the path.
  Eigen::Vector3d point_map = Eigen::Vector3d::Zero();  ///< Centre of the box there.
  Cell voxel;                                           ///< A voxel that the box meets there.
};

/// Sweeps a box along the straight segments between waypoints, its faces parallel to the axes of
/// the map, its centre on the path, and finds the first place where it meets an obstacle; kNotFound: the whole
/// path is free.
///
/// Exact for every straight motion, whatever its direction: a voxel is met when the moving box
/// overlaps it by more than 1e-6 voxels, as in Grid::toCellBox; touching faces do not count.
///
/// Cases:
///   - one waypoint: the box standing there, as segment 0 of no length;
///   - it starts in an obstacle: contact in segment 0 at distance 0;
///   - no waypoints, a number that is not finite, an edge that is not > 0, or a waypoint from
///     which the box reaches out of the grid's range: kInvalid;
///   - others change the map meanwhile (MapUnlock): each brick counts as it is when the box gets there.
///
/// @param size_m  Edges of the box.
/// @complexity O(bricks swept, and voxels in the way near them).
Answer<PathContact> checkPath(const CuboidMap& map,
                              const std::vector<Eigen::Vector3d>& waypoints_map,
                              const Eigen::Vector3d& size_m, UnknownPolicy policy, Budget& budget);

/// Whether checkPath() answers kNotFound. Faster for blocked paths: ends at any contact, not the first one.
[[nodiscard]] bool isPathFree(const CuboidMap& map,
                              const std::vector<Eigen::Vector3d>& waypoints_map,
                              const Eigen::Vector3d& size_m, UnknownPolicy policy, Budget& budget);

/// Length of a path, metres.
[[nodiscard]] double lengthOf(const std::vector<Eigen::Vector3d>& waypoints_map);

/// The box of this size around a point.
[[nodiscard]] inline MetricBox boxAround(const Eigen::Vector3d& center_m,
                                         const Eigen::Vector3d& size_m) {
  return {center_m - 0.5 * size_m, center_m + 0.5 * size_m};
}

}  // namespace cuboid_mapping
