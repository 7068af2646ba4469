// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/budget.h"
#include "cuboid_mapping/query/unknown_policy.h"
#include "cuboid_mapping/query/way_answer.h"

#include <optional>

namespace cuboid_mapping {

/// How a ray ended.
enum class RayEnd : unsigned char {
  kOccupied,  ///< The ray ends in an occupied cuboid.
  kUnknown,   ///< At the border of unknown space (UnknownPolicy::kStop).
  kMaxRange,  ///< Nothing in the way.
};

/// Answer of castRay.
struct RayQueryResult {
  RayEnd end = RayEnd::kMaxRange;  ///< How the ray ended.
  double distance_m = 0.0;         ///< Distance from the origin to `point_map`.
  Eigen::Vector3d point_map;       ///< End of the ray, metres.
  double unknown_length_m = 0.0;   ///< Length of unknown space that was passed.
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
///   - it only touches an edge or a corner of a cuboid (less than 1e-9 voxels): not hit;
///   - direction zero, or an argument not finite, or max_range_m <= 0: nothing;
///   - the budget is spent: nothing.
///
/// @param direction  Need not be normalized.
/// @param max_range_m  Length of the ray.
/// @complexity O(known voxels and unknown bricks passed). octomap::OccupancyOcTreeBase::castRay,
/// which answers with the centre of the voxel, where this answers with the point on the face.
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

/// The hit of castRay() with UnknownPolicy::kPass, faster, ignoring unknown space.
/// @return kInvalid for arguments that castRay() does not take.
/// @complexity O(bricks passed, and voxels of those with an occupied one).
[[nodiscard]] RayHit findFirstHit(const CuboidMap& map, const Eigen::Vector3d& origin_map,
                                  const Eigen::Vector3d& direction, double max_range_m,
                                  Budget& budget = Budget::unlimited());

}  // namespace cuboid_mapping
