// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/path_follower.h"

#include <cmath>
#include <utility>

namespace cuboid_mapping {

void PathFollower::setPath(std::vector<Eigen::Vector2d> waypoints_map) {
  waypoints_map_ = std::move(waypoints_map);
  next_ = 0;
}

void PathFollower::advance(double distance_m) {
  while (next_ < waypoints_map_.size() && distance_m > 0.0) {
    const Eigen::Vector2d way = waypoints_map_[next_] - pose_map_.translation().head<2>();
    const double length = way.norm();
    if (length > 0.0) {
      pose_map_.linear() = Eigen::AngleAxisd(std::atan2(way.y(), way.x()), Eigen::Vector3d::UnitZ())
                               .toRotationMatrix();
    }
    if (length > distance_m) {
      pose_map_.translation().head<2>() += way * (distance_m / length);
      return;
    }
    pose_map_.translation().head<2>() = waypoints_map_[next_++];
    distance_m -= length;
  }
}

}  // namespace cuboid_mapping
