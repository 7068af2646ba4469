// SPDX-License-Identifier: BSD-3-Clause
// Example:
//     Budget budget(QueryLimits{0.01});
//     const auto free = UnknownPolicy::kFree;
//     const auto obstacle = findObstacleDistance(map, {1.05, 0.5, 0.5}, 2.0, free, budget);
//     if (obstacle.isFound()) std::cout << obstacle->distance_m << " m\n";
//     if (obstacle.isNotFound()) std::cout << "more than 2 m\n";
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/answer.h"
#include "cuboid_mapping/query/budget.h"
#include "cuboid_mapping/query/unknown_policy.h"

#include <limits>

namespace cuboid_mapping {

/// Distance of a voxel to the nearest obstacle.
struct ObstacleDistance {
  /// Metres from centre to centre, 0 in an obstacle.
  double distance_m = std::numeric_limits<double>::infinity();
  /// Unit vector from the obstacle to the voxel; zero in an obstacle.
  Eigen::Vector3d gradient_map = Eigen::Vector3d::Zero();
};

/// Distance of the voxel that holds a point to the nearest obstacle. For all voxels of a region, use a
/// DistanceField.
///
/// @param bound_m  Farther obstacles are ignored.
/// @return  kNotFound, with infinity and zero, where no obstacle is within the bound. kInvalid for a point that
///          is not finite or out of the grid's range, and a bound that is not > 0.
/// @complexity O(bricks and obstacle voxels within twice the distance of the answer, or within the bound).
Answer<ObstacleDistance> findObstacleDistance(const CuboidMap& map,
                                              const Eigen::Vector3d& point_map, double bound_m,
                                              UnknownPolicy policy, Budget& budget);

}  // namespace cuboid_mapping
