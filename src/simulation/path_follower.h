// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstddef>
#include <vector>

namespace cuboid_mapping {

/// A robot that goes straight from waypoint to waypoint on the ground, and turns on the spot. Obstacles do not
/// stop it.
///
/// Not thread-safe.
class PathFollower {
 public:
  /// @param T_map_base  Initial pose of the robot.
  explicit PathFollower(const Eigen::Isometry3d& T_map_base) : pose_map_(T_map_base) {}

  /// Replaces the path. The robot also goes to the first waypoint; without waypoints it stops.
  void setPath(std::vector<Eigen::Vector2d> waypoints_map);

  /// Moves the robot along the path, at most to its end. @param distance_m  >= 0.
  void advance(double distance_m);

  [[nodiscard]] const Eigen::Isometry3d& pose() const { return pose_map_; }

 private:
  Eigen::Isometry3d pose_map_;
  std::vector<Eigen::Vector2d> waypoints_map_;
  std::size_t next_ = 0;
};

}  // namespace cuboid_mapping
