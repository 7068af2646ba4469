// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/simulated_drive.h"

#include "simulation/range_check.h"
#include "transform_message.h"

#include <sensor_msgs/point_cloud2_iterator.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::DoorMotion;
using cuboid_mapping::LidarCloud;
using cuboid_mapping::LidarConfig;
using cuboid_mapping::LidarPoint;
using cuboid_mapping::RangeCheck;

constexpr char kLidarFrame[] = "lidar";

/// T_base_lidar: the lidar is on a mast.
const Eigen::Isometry3d kMount(Eigen::Translation3d(0.1, 0.0, 1.0));

LidarConfig withSeed(LidarConfig lidar, std::uint64_t seed) {
  lidar.seed = seed;
  return lidar;
}

DoorMotion toDoorMotion(const std::string& door) {
  if (door == "open") return DoorMotion::kOpen;
  return door == "closed" ? DoorMotion::kClosed : DoorMotion::kMoves;
}

}  // namespace

std::vector<std::string> checkDriveConfig(const DriveConfig& config) {
  RangeCheck check;
  check("cloud_rate", config.cloud_rate_hz, 0.01, 100.0);
  check("duration", config.duration_s, 0.0, 1e6);
  check("head_start", config.head_start_m, 0.0, 1e6);
  std::vector<std::string> errors = cuboid_mapping::checkLidarConfig(config.lidar);
  errors.insert(errors.end(), check.errors().begin(), check.errors().end());
  if (config.door != "moves" && config.door != "open" && config.door != "closed") {
    errors.push_back("door = " + config.door + ": must be moves, open or closed");
  }
  if (!config.robot.empty() && config.robot.front() == '/') {
    errors.push_back("robot = " + config.robot + ": must not start with /");
  }
  return errors;
}

std::uint64_t computeNumClouds(const DriveConfig& config) {
  if (config.duration_s == 0.0) return 0;
  // Slightly less, so that the rounding of 0.3 s * 10 Hz gives no fourth cloud.
  const double count = std::ceil(config.duration_s * config.cloud_rate_hz - 1e-6);
  return static_cast<std::uint64_t>(std::max(1.0, count));
}

sensor_msgs::PointCloud2 toMessage(const LidarCloud& cloud, const ros::Time& stamp,
                                   const std::string& frame_id) {
  sensor_msgs::PointCloud2 message;
  message.header = makeHeader(frame_id, stamp);
  message.is_dense = false;
  sensor_msgs::PointCloud2Modifier modifier(message);
  using Field = sensor_msgs::PointField;
  modifier.setPointCloud2Fields(4, "x", 1, Field::FLOAT32, "y", 1, Field::FLOAT32, "z", 1,
                                Field::FLOAT32, "intensity", 1, Field::FLOAT32);
  modifier.resize(cloud.points.size());
  message.height = static_cast<std::uint32_t>(cloud.rings);
  message.width = static_cast<std::uint32_t>(cloud.columns);
  message.row_step = message.width * message.point_step;
  static_assert(sizeof(LidarPoint) == 4 * sizeof(float), "laid out as the fields of the message");
  std::memcpy(message.data.data(), cloud.points.data(), message.data.size());
  return message;
}

SimulatedDrive::SimulatedDrive(const DriveConfig& config)
    : config_(config),
      world_(config.seed, toDoorMotion(config.door)),
      lidar_(withSeed(config.lidar, config.seed)) {}

geometry_msgs::TransformStamped SimulatedDrive::toMountMessage(const ros::Time& stamp) const {
  return toTransformMessage(kMount, stamp, frameOf(kBaseFrame), frameOf(kLidarFrame));
}

geometry_msgs::TransformStamped SimulatedDrive::toPoseMessage(std::uint64_t index,
                                                              const ros::Time& stamp) const {
  return toPoseMessage(computePose(timeOf(index)), stamp);
}

geometry_msgs::TransformStamped SimulatedDrive::toPoseMessage(const Eigen::Isometry3d& T_map_base,
                                                              const ros::Time& stamp) const {
  return toTransformMessage(T_map_base, stamp, "map", frameOf(kBaseFrame));
}

sensor_msgs::PointCloud2 SimulatedDrive::toCloudMessage(std::uint64_t index,
                                                        const ros::Time& stamp) const {
  return toCloudMessage(index, stamp, computePose(timeOf(index)));
}

sensor_msgs::PointCloud2 SimulatedDrive::toCloudMessage(std::uint64_t index, const ros::Time& stamp,
                                                        const Eigen::Isometry3d& T_map_base) const {
  return toMessage(
      lidar_.computeCloud(world_.computeSolids(timeOf(index)), T_map_base * kMount, index), stamp,
      frameOf(kLidarFrame));
}

double SimulatedDrive::timeOf(std::uint64_t index) const {
  return static_cast<double>(index) / config_.cloud_rate_hz;
}

Eigen::Isometry3d SimulatedDrive::computePose(double time_s) const {
  return world_.computeRobotPose(time_s +
                                 config_.head_start_m / cuboid_mapping::World::kRobotSpeed);
}

std::string SimulatedDrive::frameOf(const std::string& part) const {
  return config_.robot.empty() ? part : config_.robot + '/' + part;
}

}  // namespace cuboid_mapping_ros
