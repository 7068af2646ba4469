// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/grid.h"

#include <ros/time.h>
#include <tf2/buffer_core.h>

#include <Eigen/Geometry>

#include <optional>
#include <string>

namespace cuboid_mapping_ros {

/// A transform, or why there is none.
struct TfLookup {
  std::optional<Eigen::Isometry3d> T_target_source;
  /// In the words of tf, with the roots of its tree where the frames are not connected; empty when there is a transform.
  std::string error;
};

/// A frame without the leading slash that old drivers put there and tf2 does not take.
[[nodiscard]] std::string withoutSlash(const std::string& frame_id);

/// Transform from the source frame to the target frame.
///
/// The same whether a later transform has come or not: its numbers are rounded to nine decimals.
/// Never waits, never throws. Names with and without a leading slash mean the same. A frame is where
/// it is in itself, also when tf does not know it.
/// @param stamp  0: the latest that there is.
[[nodiscard]] TfLookup lookupTransform(const tf2::BufferCore& buffer, const std::string& target,
                                       const std::string& source, const ros::Time& stamp);

/// Smallest axis-aligned box of the target frame that covers a box of the source frame.
[[nodiscard]] cuboid_mapping::MetricBox computeEnclosingBox(
    const Eigen::Isometry3d& T_target_source, const cuboid_mapping::MetricBox& box_source);

}  // namespace cuboid_mapping_ros
