// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/history/pose_track.h"
#include "cuboid_mapping/ros/conversions/points.h"
#include "cuboid_mapping/ros/middleware/core_names.h"

#include <geometry_msgs/Pose.h>
#include <nav_msgs/Path.h>
#include <ros/time.h>
#include <tf2_eigen/tf2_eigen.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <vector>

namespace cuboid_mapping_ros {

/// A pose for PoseTrack; an invalid quaternion gives a matrix that is no rotation, which PoseTrack refuses.
[[nodiscard]] inline StampedPose toStampedPose(const ros::Time& stamp,
                                               const geometry_msgs::Pose& pose) {
  Eigen::Quaterniond quaternion;
  tf2::fromMsg(pose.orientation, quaternion);
  StampedPose stamped{static_cast<std::int64_t>(stamp.toNSec()), Eigen::Isometry3d::Identity()};
  stamped.T_map_body.translation() = toVector(pose.position);
  if (std::abs(quaternion.norm() - 1.0) <= 0.1) {  // The quaternion may have few digits.
    stamped.T_map_body.linear() = quaternion.normalized().toRotationMatrix();
  } else {
    stamped.T_map_body.linear().setZero();
  }
  return stamped;
}

/// The poses of a path, each with its own stamp.
[[nodiscard]] inline std::vector<StampedPose> toStampedPoses(const nav_msgs::Path& path) {
  std::vector<StampedPose> poses;
  poses.reserve(path.poses.size());
  for (const auto& pose : path.poses) poses.push_back(toStampedPose(pose.header.stamp, pose.pose));
  return poses;
}

/// Poses of a path: leaves out bad ones (not finite, no rotation, no stamp) if they are at
/// most a twentieth; PoseTrack refuses more. Of one stamp the last counts.
[[nodiscard]] inline std::vector<StampedPose> tidyPoses(std::vector<StampedPose> poses) {
  const auto is_bad = [](const StampedPose& pose) {
    return pose.stamp_ns == 0 || pose.T_map_body.linear().isZero() ||
           !pose.T_map_body.matrix().allFinite();
  };
  const auto end = std::stable_partition(poses.begin(), poses.end(), std::not_fn(is_bad));
  if (20 * std::distance(end, poses.end()) > std::distance(poses.begin(), poses.end()))
    return poses;
  poses.erase(end, poses.end());
  std::stable_sort(poses.begin(), poses.end(), [](const StampedPose& a, const StampedPose& b) {
    return a.stamp_ns < b.stamp_ns;
  });
  const auto last_of_stamps = std::unique(
      poses.rbegin(), poses.rend(),
      [](const StampedPose& a, const StampedPose& b) { return a.stamp_ns == b.stamp_ns; });
  poses.erase(poses.begin(), last_of_stamps.base());
  return poses;
}

}  // namespace cuboid_mapping_ros
