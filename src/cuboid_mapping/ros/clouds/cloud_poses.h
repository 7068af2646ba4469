// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/conversions/sensor_message.h"
#include "cuboid_mapping/ros/conversions/sweep.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <ros/time.h>
#include <std_msgs/Header.h>
#include <tf2/buffer_core.h>

#include <Eigen/Geometry>

#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Poses of the sensor and of the robot's parts when a cloud was taken.
struct BodyPoses {
  Eigen::Isometry3d T_map_body;
  Eigen::Isometry3d T_body_cloud;
  Eigen::Isometry3d T_body_sensor;
};

/// Poses at which a cloud was taken.
struct CloudPoses {
  Eigen::Isometry3d T_map_cloud;
  Eigen::Isometry3d T_map_sensor;  ///< Its translation is where the beams start.
  /// Pose of the robot's base; only with filter_ground.
  std::optional<Eigen::Isometry3d> T_map_base;
  /// Pose of the body that may be corrected; only with keep_clouds. In a slice it is the pose at the stamp.
  std::optional<BodyPoses> body;
  /// Middle of the window; 0 without one.
  Eigen::Vector3d window_center_map = Eigen::Vector3d::Zero();
  /// Poses of the frames of self_filter.parts, in their order.
  std::vector<Eigen::Isometry3d> T_map_parts;
  /// With deskew: the slices of the message, and the poses in the middle of each. Empty where it has no times.
  ///@{
  Slices slices;
  std::vector<CloudPoses> slice_poses;
  ///@}
};

/// Frames whose poses the clouds of a source need.
struct PoseFrames {
  std::string map;
  std::string sensor;              ///< Empty: that of the cloud.
  std::string base;                ///< Empty without filter_ground.
  std::string window;              ///< Empty without a window.
  bool has_body = false;           ///< With keep_clouds.
  std::string body;                ///< Empty: that of the cloud.
  std::vector<std::string> parts;  ///< Frames of self_filter.parts.

  PoseFrames(const NodeParameters& parameters, const SourceParameters& source);

  /// Frames that need a transform to the map's, besides that of the cloud.
  [[nodiscard]] std::vector<std::string> needed() const;
};

/// readPointTimes() of a source: with those of beams without return where the source maps them.
[[nodiscard]] std::optional<std::vector<double>> readSourceTimes(const SensorMessage& cloud,
                                                                 const SourceParameters& source);

/// The slices of a cloud that is to be deskewed; none where the source does not want it, or its times are none.
/// @complexity O(points).
[[nodiscard]] Slices readSlices(const SensorMessage& cloud, const SourceParameters& source);

/// The poses of a cloud at its stamp, and of its slices. Never waits. @param slices  Of readSlices().
/// @return Nothing when tf does not have all of them: never a wrong pose. @param error  Says why.
[[nodiscard]] std::optional<CloudPoses> lookupPoses(const tf2::BufferCore& tf,
                                                    const PoseFrames& frames,
                                                    const std_msgs::Header& header,
                                                    const Slices& slices, std::string& error);

/// Answer of tf for a cloud.
struct PoseSearch {
  std::optional<CloudPoses> poses;  ///< Found.
  std::string why;                  ///< If not: what is missing, with the frames.
  /// If not: by how much the cloud is later than the newest transforms; nothing where tf does not connect the frames.
  std::optional<double> lead_s;
  bool is_too_old = false;  ///< If not: tf has forgotten that time.

  /// Whether a later cloud of this frame cannot have poses either.
  [[nodiscard]] bool blocksLater() const { return !poses && !(lead_s && *lead_s <= 0.0); }
};

/// lookupPoses(), and what is wrong where there are none.
[[nodiscard]] PoseSearch findPoses(tf2::BufferCore& tf, const PoseFrames& frames,
                                   const std_msgs::Header& header, const Slices& slices);

}  // namespace cuboid_mapping_ros
