// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "simulation/simulated_drive.h"

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/LaserScan.h>

#include <cstdint>
#include <vector>

namespace cuboid_mapping_ros {

/// Other sensors on the robot of a SimulatedDrive: a lidar at the rear, a planar laser in front, and a forward
/// depth camera.
///
/// Time is counted in ticks, six to each cloud of the drive: at 10 clouds a second there are 10 clouds of the
/// rear lidar, 20 scans and 30 images. The frames are base_link -> rear_lidar, laser and camera. The same
/// configuration, tick and stamp give the same bytes. Thread-safe: const.
class SimulatedSensors {
 public:
  static constexpr std::uint64_t kTicksACloud = 6;

  /// Whether a sensor measures at a tick. The drive's lidar measures at multiples of kTicksACloud.
  ///@{
  [[nodiscard]] static bool hasCloud(std::uint64_t tick) { return tick % kTicksACloud == 3; }
  [[nodiscard]] static bool hasScan(std::uint64_t tick) { return tick % 3 == 1; }
  [[nodiscard]] static bool hasImage(std::uint64_t tick) { return tick % 2 == 0; }
  ///@}

  /// @pre checkDriveConfig(config) finds no error. @param config  Drive; the rear lidar is like its lidar.
  explicit SimulatedSensors(const DriveConfig& config);

  /// Ticks per second.
  [[nodiscard]] double tickRate() const { return kTicksACloud * config_.cloud_rate_hz; }

  /// Static transforms base_link -> each sensor.
  [[nodiscard]] std::vector<geometry_msgs::TransformStamped> toMountMessages(
      const ros::Time& stamp) const;
  /// Transform map -> base_link.
  [[nodiscard]] geometry_msgs::TransformStamped toPoseMessage(std::uint64_t tick,
                                                              const ros::Time& stamp) const;
  /// Cloud of the rear lidar, with the format of the drive's clouds.
  [[nodiscard]] sensor_msgs::PointCloud2 toCloudMessage(std::uint64_t tick,
                                                        const ros::Time& stamp) const;
  /// Scan of 270 degrees in steps of half a degree; +inf without return.
  [[nodiscard]] sensor_msgs::LaserScan toScanMessage(std::uint64_t tick,
                                                     const ros::Time& stamp) const;
  /// Image of 80 x 60 pixels, 16UC1; 0 without return.
  [[nodiscard]] sensor_msgs::Image toImageMessage(std::uint64_t tick, const ros::Time& stamp) const;
  [[nodiscard]] sensor_msgs::CameraInfo toCameraMessage(const ros::Time& stamp) const;

 private:
  /// @param lidar  Beams of a sensor. @param T_base_sensor  Its pose.
  [[nodiscard]] cuboid_mapping::LidarCloud measure(const cuboid_mapping::Lidar& lidar,
                                                   const Eigen::Isometry3d& T_base_sensor,
                                                   std::uint64_t tick) const;
  [[nodiscard]] double timeOf(std::uint64_t tick) const;

  DriveConfig config_;
  SimulatedDrive drive_;
  cuboid_mapping::Lidar rear_lidar_;
  cuboid_mapping::Lidar laser_;
  cuboid_mapping::Lidar camera_;
};

}  // namespace cuboid_mapping_ros
