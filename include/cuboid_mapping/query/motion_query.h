// SPDX-License-Identifier: BSD-3-Clause
// Example:
//     const Body base{{}, {{Eigen::Isometry3d::Identity(), {0.6, 0.4, 0.3}}}};
//     const Eigen::Isometry3d from(Eigen::Translation3d(0.5, 0.5, 0.5));
//     const Eigen::Isometry3d to(Eigen::Translation3d(3.5, 0.5, 0.5));
//     Budget budget(QueryLimits{0.1});
//     const auto contact = checkMotion(map, base, {from, to}, UnknownPolicy::kObstacle, budget);
//     if (contact.isNotFound()) std::cout << "the way is free\n";
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

/// Tolerance of checkMotion(), in voxels: it moves the faces of a body outwards by at most this before it
/// refuses a motion.
constexpr double kMotionTolerance = 1.0 / 32.0;

/// Reason why checkMotion() cannot answer, and the cure; empty if it can.
/// @param name  What the reason calls the poses.
[[nodiscard]] std::string findFault(const Body& body,
                                    const std::vector<Eigen::Isometry3d>& T_map_body,
                                    const Grid& grid, const std::string& name = "poses");

/// Moves a body from pose to pose, and finds the first obstacle that it meets.
///
/// Between two poses the origin of the body moves straight, and the body turns the shortest way about one axis
/// at an even rate: about z if both poses are upright. kNotFound, a free motion, is exact, as in checkPoses(), for
/// every point of the motion. kFound, a contact, is conservative: where the body turns, or moves neither along nor across its edges, it
/// may refuse gaps less than 0.1 voxels wider than the body. One pose, and motions of boxes along their own
/// edges, are exact.
///
/// Cases:
///   - one pose: the body stands there, as segment 0 of no length;
///   - a fault, see findFault(): kInvalid. Half a turn is one, because it could go either way.
///
/// @param T_map_body  The poses.
/// @param budget  Counts bricks and poses.
/// @complexity One pose of checkPoses() for each 8 voxels that a point of the body moves; near obstacles up to
/// 255.
Answer<MotionContact> checkMotion(const CuboidMap& map, const Body& body,
                                  const std::vector<Eigen::Isometry3d>& T_map_body,
                                  UnknownPolicy policy, Budget& budget);

/// Length of the path of a body's origin from pose to pose, metres.
[[nodiscard]] double lengthOf(const std::vector<Eigen::Isometry3d>& T_map_body);

}  // namespace cuboid_mapping
