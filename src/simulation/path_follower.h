// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstddef>
#include <vector>

namespace cuboid_mapping {

/// A robot that goes straight from waypoint to waypoint on the ground, and turns on the spot. Obstacles do not stop it.
///
/// Not thread-safe.
class PathFollower {
 public:
  /// @param T_map_base  Where it stands.
  explicit PathFollower(const Eigen::Isometry3d& T_map_base) : pose_map_(T_map_base) {}

  /// Takes the place of the previous path. The robot goes to the first waypoint, too; without waypoints it stops.
  void setPath(std::vector<Eigen::Vector2d> waypoints_map);

  /// Goes on along the path, and no farther than its end. @param distance_m  >= 0.
  void advance(double distance_m);

  [[nodiscard]] const Eigen::Isometry3d& pose() const { return pose_map_; }

 private:
  Eigen::Isometry3d pose_map_;
  std::vector<Eigen::Vector2d> waypoints_map_;
  std::size_t next_ = 0;
};

}  // namespace cuboid_mapping
