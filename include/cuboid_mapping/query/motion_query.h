// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/query/pose_query.h"

namespace cuboid_mapping {

/// First obstacle that a moving body meets.
struct MotionContact {
  std::size_t segment = 0;  ///< Number of the pose that the segment starts from.
  double distance_m = 0.0;  ///< Free length: path of the body's origin up to there.
  Eigen::Isometry3d T_map_body = Eigen::Isometry3d::Identity();  ///< Pose of the body there.
  PoseContact contact;  ///< Part and voxel that meet from there on.
};

/// Answer of checkMotion().
struct MotionQueryResult {
  WayAnswer answer = WayAnswer::kInvalid;  ///< Whether the whole motion is free.
  double length_m =
      0.0;  ///< Length of the path of the body's origin; 0 for kInvalid and kBudgetSpent.
  std::optional<MotionContact> contact;  ///< The contact of kBlocked.

  /// Whether the whole motion was looked at, and meets nothing.
  [[nodiscard]] bool isFree() const { return answer == WayAnswer::kFree; }
};

/// By which the faces of a body are moved outwards in checkMotion() before a motion is refused, in voxels.
constexpr double kMotionTolerance = 1.0 / 32.0;

/// Reason why checkMotion() cannot answer, and the cure; empty if it can.
[[nodiscard]] std::string findFault(const Body& body,
                                    const std::vector<Eigen::Isometry3d>& T_map_body,
                                    const Grid& grid);

/// Moves a body from pose to pose, and finds the first obstacle that it meets.
///
/// Between two poses its origin moves straight, and it turns about one axis at an even rate, the shortest way: about z
/// when both poses are upright. Conservative: kFree is exact, as in checkPoses(), for every point of the
/// motion. Where the body turns, or moves neither along nor across its edges, gaps that are less than 0.1 voxels wider
/// than the body may be refused. One pose, and motions of boxes along their own edges, are exact.
///
/// Cases:
///   - one pose: the body stands there, as segment 0 of no length;
///   - a fault, see findFault(): kInvalid. Half a turn is one, because it could go either way;
///   - the budget is spent: kBudgetSpent.
///
/// @param T_map_body  The poses.
/// @param budget  Bricks and poses that are looked up.
/// @complexity A pose as in checkPoses() for each 8 voxels that a point of the body moves, and near obstacles up to 255.
[[nodiscard]] MotionQueryResult checkMotion(const CuboidMap& map, const Body& body,
                                            const std::vector<Eigen::Isometry3d>& T_map_body,
                                            UnknownPolicy policy,
                                            Budget& budget = Budget::unlimited());

}  // namespace cuboid_mapping
