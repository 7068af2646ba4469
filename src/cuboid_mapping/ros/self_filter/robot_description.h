// SPDX-License-Identifier: BSD-3-Clause
// Internal to self_filter_step.h: parts of the robot, and the collision shapes of a URDF.
#pragma once

#include "cuboid_mapping/geometry/grid.h"
#include "cuboid_mapping/ros/middleware/core_names.h"

#include <Eigen/Core>

#include <functional>
#include <set>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// A closed volume, in metres.
struct Solid {
  MetricBox bounds;  ///< Bounding box of the volume.
  /// Whether a point within `bounds` lies in it. Thread-safe.
  std::function<bool(const Eigen::Vector3d& point)> contains;
};

/// A part of the robot, which moves with a frame of tf.
struct RobotPart {
  std::string frame_id;
  Solid padded;  ///< Points inside are points on the robot.
  Solid exact;   ///< Space that only the robot can occupy.
};
using RobotParts = std::vector<RobotPart>;

/// A part whose exact and padded volumes are one box.
[[nodiscard]] inline RobotPart makeBoxPart(const std::string& frame_id, const MetricBox& box) {
  const Solid solid{box, [](const Eigen::Vector3d& /*point*/) { return true; }};
  return {frame_id, solid, solid};
}

/// Whether this build can read URDFs: urdf and geometric_shapes were found.
[[nodiscard]] bool canReadRobotDescriptions();

/// The collision shapes of a robot, each in the frame of its link. A mesh counts as its convex hull.
///
/// @param urdf  Text of the URDF. @param padding_m  >= 0. @param ignored_links  Links whose shapes are left
///              out.
/// @throws std::runtime_error  for an invalid URDF, a mesh that cannot be read, a link to be ignored that does
///         not exist, no shape at all; and if this build cannot read URDFs.
[[nodiscard]] RobotParts readRobotDescription(const std::string& urdf, double padding_m,
                                              const std::set<std::string>& ignored_links);

}  // namespace cuboid_mapping_ros
