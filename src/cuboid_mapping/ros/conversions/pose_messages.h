// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/history/pose_track.h"
#include "cuboid_mapping/ros/middleware/core_names.h"

#include <geometry_msgs/Pose.h>
#include <nav_msgs/Path.h>
#include <ros/time.h>

#include <vector>

namespace cuboid_mapping_ros {

/// A pose for PoseTrack; an invalid quaternion gives a matrix that is no rotation, which PoseTrack refuses.
[[nodiscard]] StampedPose toStampedPose(const ros::Time& stamp, const geometry_msgs::Pose& pose);

/// The poses of a path, each with its own stamp.
[[nodiscard]] std::vector<StampedPose> toStampedPoses(const nav_msgs::Path& path);

}  // namespace cuboid_mapping_ros
