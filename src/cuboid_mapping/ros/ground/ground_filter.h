// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/parameters/parameters.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <vector>

namespace cuboid_mapping_ros {

/// Ground and other points, each in the order of the cloud.
struct GroundSplit {
  std::vector<Eigen::Vector3f> ground;
  std::vector<Eigen::Vector3f> others;
  bool is_plane_found = false;
};

/// Separates the points of the ground from the others.
///
/// Planes that are nearly level are segmented (PCL, RANSAC with a fixed seed) until one lies near
/// z = 0 of the base frame: its points are the ground. Cases:
///   - no such plane: the points within plane_distance_m of z = 0 of the base frame;
///   - fewer than 50 points: none is ground.
///
/// @param T_base_cloud  Takes the points to the robot's base, whose z is up and 0 on the ground.
/// @complexity O(planes n), at most 200 tries a plane.
[[nodiscard]] GroundSplit splitGround(const std::vector<Eigen::Vector3f>& points_cloud,
                                      const Eigen::Isometry3d& T_base_cloud,
                                      const GroundFilterConfig& config);

}  // namespace cuboid_mapping_ros
