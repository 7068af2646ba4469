// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "simulation/lidar.h"

#include <geometry_msgs/TransformStamped.h>
#include <ros/time.h>
#include <sensor_msgs/PointCloud2.h>

#include <cstdint>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Sensor and duration of a drive through the simulated building.
struct DriveConfig {
  DriveConfig() { lidar.columns = 450; }  // Half of the lidar's own default, for small machines.

  std::uint64_t seed = 1;  ///< Seed of the world and of the noise.
  cuboid_mapping::LidarConfig lidar;
  double cloud_rate_hz = 10.0;  ///< Clouds per second of simulated time, 0.01 to 100.
  double duration_s = 0.0;      ///< Simulated time, 0 to 1e6; 0: for ever.
  std::string robot;            ///< Its frames are NAME/base_link and NAME/lidar; empty: no NAME.
  std::string door = "moves";   ///< moves, open or closed.
  double head_start_m = 0.0;    ///< Distance that the robot has travelled at time 0, 0 to 1e6.
};

/// Errors of a configuration, a line each: key, value, allowed range. Empty: none.
[[nodiscard]] std::vector<std::string> checkDriveConfig(const DriveConfig& config);

/// Number of clouds in the configured duration, at least one; 0 if it has no end.
[[nodiscard]] std::uint64_t computeNumClouds(const DriveConfig& config);

/// Frame of the robot.
constexpr char kBaseFrame[] = "base_link";

/// Converts to an organized cloud with float32 fields x, y, z and intensity, NaN without return.
[[nodiscard]] sensor_msgs::PointCloud2 toMessage(const cuboid_mapping::LidarCloud& cloud,
                                                 const ros::Time& stamp,
                                                 const std::string& frame_id);

/// The messages of a lidar on a robot that drives through the simulated building, lap after lap.
///
/// The frames are map -> base_link -> lidar, the latter two with the robot's name as prefix. The same
/// configuration, index and stamp give the same bytes. Thread-safe: const.
class SimulatedDrive {
 public:
  /// @pre checkDriveConfig(config) finds no error.
  explicit SimulatedDrive(const DriveConfig& config);

  /// Static transform base_link -> lidar.
  [[nodiscard]] geometry_msgs::TransformStamped toMountMessage(const ros::Time& stamp) const;

  /// Transform map -> base_link at cloud `index`, or at another pose.
  ///@{
  [[nodiscard]] geometry_msgs::TransformStamped toPoseMessage(std::uint64_t index,
                                                              const ros::Time& stamp) const;
  [[nodiscard]] geometry_msgs::TransformStamped toPoseMessage(const Eigen::Isometry3d& T_map_base,
                                                              const ros::Time& stamp) const;
  ///@}

  /// Cloud `index`, from its pose or another one: organized, float32 fields x, y, z and intensity, NaN without
  /// return.
  ///@{
  [[nodiscard]] sensor_msgs::PointCloud2 toCloudMessage(std::uint64_t index,
                                                        const ros::Time& stamp) const;
  [[nodiscard]] sensor_msgs::PointCloud2 toCloudMessage(std::uint64_t index, const ros::Time& stamp,
                                                        const Eigen::Isometry3d& T_map_base) const;
  ///@}

  [[nodiscard]] const cuboid_mapping::World& world() const { return world_; }
  /// Seconds from the start to cloud `index`.
  [[nodiscard]] double timeOf(std::uint64_t index) const;
  /// T_map_base at a time.
  [[nodiscard]] Eigen::Isometry3d computePose(double time_s) const;
  /// The frame of a part of the robot, with its name as prefix.
  [[nodiscard]] std::string frameOf(const std::string& part) const;

 private:
  DriveConfig config_;
  cuboid_mapping::World world_;
  cuboid_mapping::Lidar lidar_;
};

}  // namespace cuboid_mapping_ros
