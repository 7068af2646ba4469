// SPDX-License-Identifier: BSD-3-Clause
// Example:
//     const Body ball{{{Eigen::Vector3d::Zero(), 0.3}}, {}};  // Radius in metres.
//     const std::vector<Eigen::Isometry3d> poses(1, Eigen::Isometry3d::Identity());
//     Budget budget(QueryLimits{0.01});
//     const auto contacts = checkPoses(map, ball, poses, UnknownPolicy::kObstacle, budget);
//     if (contacts[0].isFound()) std::cout << "meets voxel " << contacts[0]->voxel << '\n';
#pragma once

#include "cuboid_mapping/geometry/isometry.h"

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/answer.h"
#include "cuboid_mapping/query/budget.h"
#include "cuboid_mapping/query/unknown_policy.h"

#include <cstddef>
#include <string>
#include <vector>

namespace cuboid_mapping {

/// A ball of a Body.
struct BodySphere {
  Eigen::Vector3d center_body = Eigen::Vector3d::Zero();  ///< Metres.
  double radius_m = 0.0;                                  ///< > 0.
};

/// A box of a Body, turned in any way.
struct BodyBox {
  Eigen::Isometry3d T_body_box = Eigen::Isometry3d::Identity();  ///< Pose of its centre and axes.
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();              ///< Edges, > 0.
};

/// The shape of a robot that turns, or of its load, in a frame of its own.
struct Body {
  /// Maximum reach of a body from its origin, in voxels.
  static constexpr double kMaxReach = 4096.0;
  /// Smallest radius and edge, in voxels.
  static constexpr double kMinSize = 1e-3;

  std::vector<BodySphere> spheres;  ///< Parts 0, 1 and so on.
  std::vector<BodyBox> boxes;       ///< The parts after them.
};

/// Greatest distance of a point of a body from its origin, metres.
[[nodiscard]] double reachOf(const Body& body);

/// Reason why checkPoses() cannot answer for a body, and the cure; empty if it can.
[[nodiscard]] std::string findFault(const Body& body, const Grid& grid);

/// Contact of a body with the map.
struct PoseContact {
  std::size_t part = 0;  ///< Number of the sphere, or number of spheres plus that of the box.
  Cell voxel;            ///< A voxel that the part meets.
};

/// An obstacle that a body meets, for each of many poses; kNotFound: the body is free there.
///
/// Exact in voxels, for every orientation: a part meets a voxel if both overlap by more than 1e-6 voxels, as in
/// Grid::toCellBox; touching faces do not count. Boxes are compared by separating axes (S. Gottschalk et al.,
/// "OBBTree", 1996), spheres by the distance to the voxel.
///
/// Cases:
///   - a pose that is not finite, is no rotation (to 1e-6), or takes the body out of the grid's range:
///     kInvalid;
///   - a body with a fault, see findFault(): kInvalid for all poses;
///   - the budget is spent: kBudgetSpent for this pose and those after it.
///
/// @param T_map_body  The poses. Poses close to the one before are faster.
/// @param budget  Counts bricks.
/// @complexity O(bricks that the body overlaps, and obstacle voxels near it) for each pose, until the first
/// contact.
[[nodiscard]] std::vector<Answer<PoseContact>> checkPoses(
    const CuboidMap& map, const Body& body, const std::vector<Eigen::Isometry3d>& T_map_body,
    UnknownPolicy policy, Budget& budget);

}  // namespace cuboid_mapping
