// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/simulated_sensors.h"

#include "transform_message.h"

#include <cmath>
#include <cstring>
#include <limits>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::Lidar;
using cuboid_mapping::LidarCloud;
using cuboid_mapping::LidarConfig;

constexpr char kRearFrame[] = "rear_lidar";
constexpr char kLaserFrame[] = "laser";
constexpr char kCameraFrame[] = "camera";

// T_base_sensor. A camera looks along z, with x to the right and y down.
const Eigen::Isometry3d kRearMount =
    Eigen::Translation3d(-0.3, 0.0, 0.8) * Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ());
const Eigen::Isometry3d kLaserMount(Eigen::Translation3d(0.3, 0.0, 0.25));
const Eigen::Isometry3d kCameraMount =
    Eigen::Translation3d(0.3, 0.0, 0.6) * Eigen::Quaterniond(-0.5, 0.5, -0.5, 0.5);

constexpr int kScanBeams = 541;
constexpr float kScanStep_rad = static_cast<float>(M_PI / 360.0);
constexpr float kScanBegin_rad = -270.0F * kScanStep_rad;
constexpr double kScanRange_m = 20.0;

constexpr int kImageWidth = 80;
constexpr int kImageHeight = 60;
constexpr double kFocalLength = 60.0;  // In pixels.
constexpr double kImageRange_m = 8.0;

/// A sensor like the lidar, with its own beams and noise.
LidarConfig likeLidar(const DriveConfig& drive, int rings, int columns, double max_range_m,
                      std::uint64_t number) {
  LidarConfig config = drive.lidar;
  config.rings = rings;
  config.columns = columns;
  config.max_range_m = max_range_m;
  config.seed = drive.seed + number;
  return config;
}

LidarConfig ofRearLidar(const DriveConfig& drive) {
  return likeLidar(drive, drive.lidar.rings, drive.lidar.columns, drive.lidar.max_range_m, 1);
}

Lidar makeLaser(const DriveConfig& drive) {
  std::vector<Eigen::Vector3d> directions;
  for (int i = 0; i < kScanBeams; ++i) {
    const double angle =
        static_cast<double>(kScanBegin_rad) + i * static_cast<double>(kScanStep_rad);
    directions.emplace_back(std::cos(angle), std::sin(angle), 0.0);
  }
  return {likeLidar(drive, 1, kScanBeams, kScanRange_m, 2), std::move(directions)};
}

Lidar makeCamera(const DriveConfig& drive) {
  std::vector<Eigen::Vector3d> directions;
  for (int v = 0; v < kImageHeight; ++v) {
    for (int u = 0; u < kImageWidth; ++u) {
      directions.push_back(Eigen::Vector3d((u - 0.5 * kImageWidth) / kFocalLength,
                                           (v - 0.5 * kImageHeight) / kFocalLength, 1.0)
                               .normalized());
    }
  }
  return {likeLidar(drive, kImageHeight, kImageWidth, kImageRange_m, 3), std::move(directions)};
}

}  // namespace

SimulatedSensors::SimulatedSensors(const DriveConfig& config)
    : config_(config),
      drive_(config),
      rear_lidar_(ofRearLidar(config)),
      laser_(makeLaser(config)),
      camera_(makeCamera(config)) {}

std::vector<geometry_msgs::TransformStamped> SimulatedSensors::toMountMessages(
    const ros::Time& stamp) const {
  const auto mount = [&](const Eigen::Isometry3d& T_base_sensor, const char* frame) {
    return toTransformMessage(T_base_sensor, stamp, drive_.frameOf(kBaseFrame),
                              drive_.frameOf(frame));
  };
  return {mount(kRearMount, kRearFrame), mount(kLaserMount, kLaserFrame),
          mount(kCameraMount, kCameraFrame)};
}

geometry_msgs::TransformStamped SimulatedSensors::toPoseMessage(std::uint64_t tick,
                                                                const ros::Time& stamp) const {
  return toTransformMessage(drive_.computePose(timeOf(tick)), stamp, "map",
                            drive_.frameOf(kBaseFrame));
}

sensor_msgs::PointCloud2 SimulatedSensors::toCloudMessage(std::uint64_t tick,
                                                          const ros::Time& stamp) const {
  return toMessage(measure(rear_lidar_, kRearMount, tick), stamp, drive_.frameOf(kRearFrame));
}

sensor_msgs::LaserScan SimulatedSensors::toScanMessage(std::uint64_t tick,
                                                       const ros::Time& stamp) const {
  sensor_msgs::LaserScan scan;
  scan.header = makeHeader(drive_.frameOf(kLaserFrame), stamp);
  scan.angle_min = kScanBegin_rad;
  scan.angle_max = kScanBegin_rad + (kScanBeams - 1) * kScanStep_rad;
  scan.angle_increment = kScanStep_rad;
  scan.range_min = 0.05F;
  scan.range_max = static_cast<float>(kScanRange_m);
  for (const auto& point : measure(laser_, kLaserMount, tick).points) {
    scan.ranges.push_back(std::isnan(point.x) ? std::numeric_limits<float>::infinity()
                                              : std::hypot(point.x, point.y));
  }
  return scan;
}

sensor_msgs::Image SimulatedSensors::toImageMessage(std::uint64_t tick,
                                                    const ros::Time& stamp) const {
  sensor_msgs::Image image;
  image.header = makeHeader(drive_.frameOf(kCameraFrame), stamp);
  image.width = kImageWidth;
  image.height = kImageHeight;
  image.encoding = "16UC1";
  image.step = kImageWidth * sizeof(std::uint16_t);
  std::vector<std::uint16_t> depths_mm;
  for (const auto& point : measure(camera_, kCameraMount, tick).points) {
    depths_mm.push_back(
        std::isnan(point.z) ? 0 : static_cast<std::uint16_t>(std::lround(1000.0F * point.z)));
  }
  image.data.resize(depths_mm.size() * sizeof(std::uint16_t));
  std::memcpy(image.data.data(), depths_mm.data(), image.data.size());
  return image;
}

sensor_msgs::CameraInfo SimulatedSensors::toCameraMessage(const ros::Time& stamp) const {
  sensor_msgs::CameraInfo camera;
  camera.header = makeHeader(drive_.frameOf(kCameraFrame), stamp);
  camera.width = kImageWidth;
  camera.height = kImageHeight;
  camera.K = {kFocalLength, 0, 0.5 * kImageWidth, 0, kFocalLength, 0.5 * kImageHeight, 0, 0, 1};
  camera.P = {
      kFocalLength, 0, 0.5 * kImageWidth, 0, 0, kFocalLength, 0.5 * kImageHeight, 0, 0, 0, 1, 0};
  return camera;
}

LidarCloud SimulatedSensors::measure(const Lidar& lidar, const Eigen::Isometry3d& T_base_sensor,
                                     std::uint64_t tick) const {
  const double time_s = timeOf(tick);
  return lidar.computeCloud(drive_.world().computeSolids(time_s),
                            drive_.computePose(time_s) * T_base_sensor, tick);
}

double SimulatedSensors::timeOf(std::uint64_t tick) const {
  return static_cast<double>(tick) / tickRate();
}

}  // namespace cuboid_mapping_ros
