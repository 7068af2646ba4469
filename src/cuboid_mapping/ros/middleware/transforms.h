// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <geometry_msgs/TransformStamped.h>
#include <tf2/buffer_core.h>

#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// A transform as tf2 takes it: frames without the slash of old drivers, and a rotation of length 1, as tf made it, where
/// it has been written with few digits (length 0.9 to 1.1). tf2 would stretch what it turns by up to half a percent.
[[nodiscard]] geometry_msgs::TransformStamped tidyTransform(
    geometry_msgs::TransformStamped transform);

/// The transform of a text "parent child x y z yaw pitch roll", or "... x y z qx qy qz qw", in metres and radians, as
/// static_transform_publisher takes it; nothing for another text.
[[nodiscard]] std::optional<geometry_msgs::TransformStamped> parseTransform(
    const std::string& text);

/// The frames of tf that have no parent, in order of their names.
[[nodiscard]] std::vector<std::string> findRoots(const tf2::BufferCore& tf);

/// The root of the tree that a frame is in; nothing for one that tf does not know.
[[nodiscard]] std::optional<std::string> findRoot(const tf2::BufferCore& tf,
                                                  const std::string& frame_id);

/// Advice where tf does not connect two frames: names the roots; empty where tf connects them at some time.
/// @param target  The frame of the map.
[[nodiscard]] std::string adviseOnTree(const tf2::BufferCore& tf, const std::string& target,
                                       const std::string& source);

}  // namespace cuboid_mapping_ros
