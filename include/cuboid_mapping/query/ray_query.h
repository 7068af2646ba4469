// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/budget.h"
#include "cuboid_mapping/query/unknown_policy.h"
#include "cuboid_mapping/query/way_answer.h"

#include <optional>

namespace cuboid_mapping {

/// End of a ray.
enum class RayEnd : unsigned char {
  kOccupied,  ///< The ray ends in an occupied cuboid.
  kUnknown,   ///< The ray ends at the border of unknown space (UnknownPolicy::kStop).
  kMaxRange,  ///< Nothing is in the way.
};

/// Answer of castRay().
struct RayQueryResult {
  RayEnd end = RayEnd::kMaxRange;  ///< End of the ray.
  double distance_m = 0.0;         ///< Distance from the origin to `point_map`.
  Eigen::Vector3d point_map;       ///< End of the ray, metres.
  double unknown_length_m = 0.0;   ///< Length of the ray in unknown space.
  /// Distance to the first unknown space on the ray, the end of a kUnknown ray included.
  std::optional<double> first_unknown_m;
  std::optional<Cell> voxel;  ///< The occupied voxel that was hit; findCuboid() has its cuboid.
};

/// Casts a ray from a point (metres, map frame) until something is in the way.
///
/// Cases:
///   - origin in an occupied cuboid: kOccupied at distance 0;
///   - origin in unknown space, outside the map included: kUnknown at 0, or passed, by policy;
///   - the ray leaves the map: the outside is unknown;
///   - it has less than 1e-9 voxels of its length in a voxel, as at an edge or a corner: not hit;
///   - direction zero, or an argument not finite, or max_range_m <= 0: nothing;
///   - the budget is spent: nothing.
///
/// @param direction  Need not be normalized.
/// @param max_range_m  Length of the ray.
/// @complexity O(bricks passed, and voxels of those that are neither unknown nor all free). J. Amanatides, A.
/// Woo, 1987. Unlike octomap::OccupancyOcTreeBase::castRay, it gives the point on the face of the voxel, not
/// its centre.
[[nodiscard]] std::optional<RayQueryResult> castRay(const CuboidMap& map,
                                                    const Eigen::Vector3d& origin_map,
                                                    const Eigen::Vector3d& direction,
                                                    double max_range_m, UnknownPolicy policy,
                                                    Budget& budget = Budget::unlimited());

/// The occupied voxel that a ray hits first.
struct RayHit {
  WayAnswer answer = WayAnswer::kInvalid;  ///< Whether something is hit.
  /// The obstacle of kBlocked.
  ///@{
  Cell voxel;               ///< The voxel that is hit.
  double distance_m = 0.0;  ///< Distance from the origin to `point_map`.
  /// On its face, metres; the origin when that lies in it.
  Eigen::Vector3d point_map = Eigen::Vector3d::Zero();
  ///@}
};

/// The hit of castRay() with UnknownPolicy::kPass. Faster, as it does not measure unknown space.
/// @return kInvalid for arguments that castRay() refuses; kBudgetSpent without a hit when the budget is spent.
/// @complexity O(bricks passed, and voxels of bricks with an occupied one).
[[nodiscard]] RayHit findFirstHit(const CuboidMap& map, const Eigen::Vector3d& origin_map,
                                  const Eigen::Vector3d& direction, double max_range_m,
                                  Budget& budget = Budget::unlimited());

}  // namespace cuboid_mapping
