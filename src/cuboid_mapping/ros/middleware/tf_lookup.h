// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/grid.h"
#include "cuboid_mapping/ros/middleware/core_names.h"

#include <geometry_msgs/TransformStamped.h>
#include <ros/time.h>
#include <std_msgs/Header.h>
#include <tf2/buffer_core.h>

#include <Eigen/Geometry>

#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// A transform, or the reason why there is none.
struct TfLookup {
  std::optional<Eigen::Isometry3d> T_target_source;
  /// Error text of tf, with the roots of its tree if the frames are not connected; empty if there is a
  /// transform.
  std::string error;
};

/// A frame without the leading slash of old drivers, which tf2 refuses.
[[nodiscard]] std::string withoutSlash(const std::string& frame_id);
/// Whether a message says in which frame it is: a slash alone is no name.
[[nodiscard]] inline bool hasFrame(const std_msgs::Header& header) {
  return !withoutSlash(header.frame_id).empty();
}

/// Transform from the source frame to the target frame.
///
/// A later transform does not change the result: its numbers are rounded to nine decimals.
/// Never waits, never throws. Names with and without a leading slash mean the same. From a frame to itself
/// it is the identity, even if tf does not know the frame.
/// @param stamp  Time of the transform; 0: the latest.
[[nodiscard]] TfLookup lookupTransform(const tf2::BufferCore& buffer, const std::string& target,
                                       const std::string& source, const ros::Time& stamp);

/// Smallest axis-aligned box of the target frame that covers a box of the source frame.
[[nodiscard]] MetricBox computeEnclosingBox(const Eigen::Isometry3d& T_target_source,
                                            const MetricBox& box_source);

/// A transform for tf2: frames without the slash of old drivers, and a rotation of length 1, even if it was
/// written with few digits (length 0.9 to 1.1). Otherwise tf2 would stretch rotated vectors by up to one percent.
[[nodiscard]] geometry_msgs::TransformStamped tidyTransform(
    geometry_msgs::TransformStamped transform);

/// A frame and its ancestors, the root last.
[[nodiscard]] std::vector<std::string> findAncestors(const tf2::BufferCore& tf,
                                                     const std::string& frame_id);

/// The root of a frame's tree; nothing for a frame that tf does not know.
[[nodiscard]] std::optional<std::string> findRoot(const tf2::BufferCore& tf,
                                                  const std::string& frame_id);

}  // namespace cuboid_mapping_ros
