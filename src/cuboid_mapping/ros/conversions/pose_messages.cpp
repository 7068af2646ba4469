// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/conversions/pose_messages.h"

#include "cuboid_mapping/ros/conversions/points.h"

#include <tf2_eigen/tf2_eigen.h>

#include <cmath>

namespace cuboid_mapping_ros {

StampedPose toStampedPose(const ros::Time& stamp, const geometry_msgs::Pose& pose) {
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

std::vector<StampedPose> toStampedPoses(const nav_msgs::Path& path) {
  std::vector<StampedPose> poses;
  poses.reserve(path.poses.size());
  for (const auto& pose : path.poses) poses.push_back(toStampedPose(pose.header.stamp, pose.pose));
  return poses;
}

}  // namespace cuboid_mapping_ros
