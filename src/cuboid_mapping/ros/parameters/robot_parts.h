// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/grid.h"
#include "cuboid_mapping/ros/middleware/core_names.h"

#include <Eigen/Core>

#include <functional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// A closed volume, in metres.
struct Solid {
  MetricBox bounds;  ///< Bounding box of the volume.
  /// Whether a point lies in it. Thread-safe.
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

}  // namespace cuboid_mapping_ros
