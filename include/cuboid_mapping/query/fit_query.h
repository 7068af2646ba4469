// SPDX-License-Identifier: BSD-3-Clause
// Example:
//     Budget budget(QueryLimits{0.1});
//     const Eigen::Vector3d size_m(0.5, 0.5, 0.5);
//     const auto stop = UnknownPolicy::kObstacle;
//     const auto place = findNearestFit(map, {2.0, 0.5, 0.5}, size_m, stop, 2.0, budget);
//     if (place.isFound()) std::cout << "free at " << place->center_map.transpose() << '\n';
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/answer.h"
#include "cuboid_mapping/query/budget.h"
#include "cuboid_mapping/query/unknown_policy.h"

namespace cuboid_mapping {

/// A place where a box fits.
struct FitPlace {
  Eigen::Vector3d center_map = Eigen::Vector3d::Zero();  ///< Centre of the box, metres.
  double distance_m = 0.0;                               ///< Distance of the centre from the point.
};

/// The place nearest to a point at which a box fits between the obstacles, with its faces parallel to the axes of
/// the map.
///
/// Exact, also between places on the grid: the box fits where it overlaps no obstacle voxel by more than 1e-6
/// voxels.
///
/// Cases:
///   - it fits at the point itself: that point;
///   - no such place within max_distance_m: kNotFound;
///   - an argument that is not finite, an edge that is not > 0, max_distance_m < 0, or places beyond the grid's
///     range: kInvalid.
///
/// @complexity O(bricks within the distance of the answer, or within max_distance_m if there is none), a few
/// microseconds each.
Answer<FitPlace> findNearestFit(const CuboidMap& map, const Eigen::Vector3d& point_map,
                                const Eigen::Vector3d& size_m, UnknownPolicy policy,
                                double max_distance_m, Budget& budget);

}  // namespace cuboid_mapping
