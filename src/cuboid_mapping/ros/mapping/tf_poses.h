// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/conversions/cloud_error.h"
#include "cuboid_mapping/ros/conversions/sensor_conversions.h"
#include "cuboid_mapping/ros/middleware/tf_buffer.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <ros/duration.h>
#include <ros/time.h>
#include <std_msgs/Header.h>

#include <Eigen/Geometry>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Slices of a message by number, in order: slice i has the points from i to i + 1 milliseconds after the stamp.
using Slices = std::vector<std::int32_t>;

/// Length of a slice.
constexpr std::int64_t kSliceNanoseconds = 1'000'000;

/// Middle of a slice, after the stamp.
[[nodiscard]] ros::Duration middleOf(std::int32_t slice);

/// Poses of the body that may be corrected, at the time of a cloud.
struct BodyPoses {
  Eigen::Isometry3d T_map_body;
  Eigen::Isometry3d T_body_cloud;
  Eigen::Isometry3d T_body_sensor;
};

/// Poses at the time of a cloud.
struct CloudPoses {
  Eigen::Isometry3d T_map_cloud;
  Eigen::Isometry3d T_map_sensor;  ///< Its translation is the start of the beams.
  /// Poses of PoseFrames::steps.
  std::vector<Eigen::Isometry3d> T_map_steps;
  /// Pose of the body that may be corrected; only with keep_clouds. In a slice: the pose at the stamp.
  std::optional<BodyPoses> body;
  /// Middle of the window; 0 without one.
  Eigen::Vector3d window_center_map = Eigen::Vector3d::Zero();
  /// The slices of the message, and the poses in the middle of each. Empty: all points have these poses.
  ///@{
  Slices slices;
  std::vector<CloudPoses> slice_poses;
  ///@}
};

/// A frame that a step of a source needs.
struct StepFrame {
  std::string frame_id;
  std::string cure;  ///< Where to look if tf does not have it.
};

/// Frames whose poses the clouds of a source need.
struct PoseFrames {
  std::string map;
  std::string sensor;            ///< Frame of the sensor; empty: the cloud's frame.
  std::string window;            ///< Frame of the window; empty without a window.
  bool has_body = false;         ///< True with keep_clouds.
  std::string body;              ///< Frame of the body; empty: the cloud's frame.
  std::vector<StepFrame> steps;  ///< Frames of the steps, in the order of makeSteps().

  PoseFrames(const NodeParameters& parameters, const SourceParameters& source);

  /// Frames other than the cloud's that need a transform to the map.
  [[nodiscard]] std::vector<std::string> needed() const;
};

/// Answer of tf for a cloud.
struct PoseSearch {
  std::optional<CloudPoses> poses;
  std::string why;          ///< If not found: the cause, with the frames.
  bool names_cure = false;  ///< `why` also says what to do.
  /// If not found: kTfGap; kBeforeTf if tf begins after the cloud, or has forgotten its time; kNoTransform if tf has
  /// that time, but not the connection. Later transforms do not help.
  std::optional<DropReason> hopeless;
  /// If not found: time by which the cloud is later than the newest transforms; nothing if tf does not connect
  /// the frames.
  std::optional<double> lead_s;
  double cache_s = 0.0;  ///< Time that tf keeps.
};

/// The poses of a cloud at its stamp, and of its slices. Never waits. @param slices  Those of its source's steps.
/// @return No poses unless tf has all of them, without a gap: never a wrong pose.
[[nodiscard]] PoseSearch findPoses(const TfBuffer& tf, const PoseFrames& frames,
                                   const std_msgs::Header& header, const Slices& slices);

}  // namespace cuboid_mapping_ros
