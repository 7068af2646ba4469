// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/budget.h"
#include "cuboid_mapping/query/unknown_policy.h"

#include <limits>
#include <optional>

namespace cuboid_mapping {

/// Distance of a voxel to the nearest obstacle.
struct ObstacleDistance {
  /// Metres from centre to centre, 0 in an obstacle; infinity where none is within the bound.
  double distance_m = std::numeric_limits<double>::infinity();
  /// Unit vector from the obstacle to the voxel; zero in an obstacle, and where there is none.
  Eigen::Vector3d gradient_map = Eigen::Vector3d::Zero();
};

/// Distance of the voxel that holds a point to the nearest obstacle. For all voxels of a region, use a
/// DistanceField.
///
/// @param bound_m  Farther obstacles are ignored.
/// @return  Nothing for a point that is not finite or out of the grid's range, a bound that is not > 0, and
///          when the budget is spent.
/// @complexity O(bricks and obstacle voxels within twice the distance of the answer, or within the bound).
[[nodiscard]] std::optional<ObstacleDistance> findObstacleDistance(
    const CuboidMap& map, const Eigen::Vector3d& point_map, double bound_m, UnknownPolicy policy,
    Budget& budget = Budget::unlimited());

}  // namespace cuboid_mapping
