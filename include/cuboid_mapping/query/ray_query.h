// SPDX-License-Identifier: BSD-3-Clause
// Example:
//     Budget budget(QueryLimits{0.01});
//     const auto hit = findFirstHit(map, {1, 1, 0.5}, {1, 0, 0}, 30.0, budget);
//     if (hit.isFound()) std::cout << "an obstacle after " << hit->distance_m << " m\n";
//     if (hit.isNotFound()) std::cout << "nothing in 30 m\n";
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/answer.h"
#include "cuboid_mapping/query/budget.h"
#include "cuboid_mapping/query/unknown_policy.h"

#include <optional>

namespace cuboid_mapping {

/// End of a ray.
enum class RayEnd : unsigned char {
  kOccupied,  ///< The ray ends in an occupied cuboid.
  kUnknown,   ///< The ray ends at the border of unknown space (UnknownPolicy::kObstacle).
  kMaxRange,  ///< Nothing is in the way.
};

/// Where a ray ends.
struct RayQueryResult {
  RayEnd end = RayEnd::kMaxRange;  ///< End of the ray.
  double distance_m = 0.0;         ///< Distance from the origin to `point_map`.
  Eigen::Vector3d point_map = Eigen::Vector3d::Zero();  ///< End of the ray, metres.
  double unknown_length_m = 0.0;                        ///< Length of the ray in unknown space.
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
///   - direction zero, or an argument not finite, or max_range_m <= 0: kInvalid.
///
/// @param direction  Need not be normalized.
/// @param max_range_m  Length of the ray.
/// @complexity O(bricks passed, and voxels of those that are neither unknown nor all free). J. Amanatides, A.
/// Woo, 1987. Unlike octomap::OccupancyOcTreeBase::castRay, it gives the point on the face of the voxel, not
/// its centre.
Answer<RayQueryResult> castRay(const CuboidMap& map, const Eigen::Vector3d& origin_map,
                               const Eigen::Vector3d& direction, double max_range_m,
                               UnknownPolicy policy, Budget& budget);

/// The occupied voxel that a ray hits first.
struct RayHit {
  Cell voxel;               ///< The voxel that is hit.
  double distance_m = 0.0;  ///< Distance from the origin to `point_map`.
  /// On its face, metres; the origin when that lies in it.
  Eigen::Vector3d point_map = Eigen::Vector3d::Zero();
};

/// The hit of castRay() with UnknownPolicy::kFree; kNotFound if nothing is hit, kInvalid for arguments that
/// castRay() refuses. Faster, as it does not measure unknown space.
/// @complexity O(bricks passed, and voxels of bricks with an occupied one).
Answer<RayHit> findFirstHit(const CuboidMap& map, const Eigen::Vector3d& origin_map,
                            const Eigen::Vector3d& direction, double max_range_m, Budget& budget);

}  // namespace cuboid_mapping
