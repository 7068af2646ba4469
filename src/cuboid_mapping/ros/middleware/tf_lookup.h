// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/grid.h"

#include <ros/time.h>
#include <tf2/buffer_core.h>

#include <Eigen/Geometry>

#include <optional>
#include <string>

namespace cuboid_mapping_ros {

/// A transform, or the reason why there is none.
struct TfLookup {
  std::optional<Eigen::Isometry3d> T_target_source;
  /// Error text of tf, with the roots of its tree if the frames are not connected; empty if there is a transform.
  std::string error;
};

/// A frame without the leading slash of old drivers, which tf2 refuses.
[[nodiscard]] std::string withoutSlash(const std::string& frame_id);

/// Transform from the source frame to the target frame.
///
/// A later transform does not change the result: its numbers are rounded to nine decimals.
/// Never waits, never throws. Names with and without a leading slash mean the same. From a frame to itself
/// it is the identity, even if tf does not know the frame.
/// @param stamp  Time of the transform; 0: the latest.
[[nodiscard]] TfLookup lookupTransform(const tf2::BufferCore& buffer, const std::string& target,
                                       const std::string& source, const ros::Time& stamp);

/// Smallest axis-aligned box of the target frame that covers a box of the source frame.
[[nodiscard]] cuboid_mapping::MetricBox computeEnclosingBox(
    const Eigen::Isometry3d& T_target_source, const cuboid_mapping::MetricBox& box_source);

}  // namespace cuboid_mapping_ros
