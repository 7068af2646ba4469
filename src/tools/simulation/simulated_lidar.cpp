// SPDX-License-Identifier: BSD-3-Clause
// A lidar that drives through a simulated building: as a node, or written to a rosbag.
#include "bag_output.h"
#include "command_line.h"
#include "cuboid_mapping/io/text.h"
#include "progress_bar.h"
#include "simulation/simulated_drive.h"
#include "simulation/simulated_lidar_node.h"
#include "simulation/simulated_sensors.h"
#include "stamps.h"

#include <ros/ros.h>

#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

constexpr char kName[] = "simulated_lidar";

/// @throws std::runtime_error  with all errors.
void checkBagConfig(const DriveConfig& config) {
  std::string text;
  for (const std::string& error : checkDriveConfig(config)) text += error + "; ";
  if (config.duration_s == 0.0) text += "duration = 0: a bag needs an end; ";
  if (!text.empty()) throw std::runtime_error(text.substr(0, text.size() - 2));
}

/// Messages of the other sensors from one cloud of the drive to the next.
void writeOthers(const SimulatedSensors& sensors, std::uint64_t cloud, BagOutput& bag) {
  const std::uint64_t begin = cloud * SimulatedSensors::kTicksACloud;
  for (std::uint64_t tick = begin; tick < begin + SimulatedSensors::kTicksACloud; ++tick) {
    const ros::Time stamp = computeStamp(kFirstStamp, tick, sensors.tickRate());
    tf2_msgs::TFMessage pose;
    pose.transforms.push_back(sensors.toPoseMessage(tick, stamp));
    if (tick > begin) bag.write("/tf", stamp, pose);
    if (SimulatedSensors::hasCloud(tick)) {
      bag.write("/rear/cloud", stamp, sensors.toCloudMessage(tick, stamp));
    }
    if (SimulatedSensors::hasScan(tick)) {
      bag.write("/scan", stamp, sensors.toScanMessage(tick, stamp));
    }
    if (SimulatedSensors::hasImage(tick)) {
      bag.write("/camera/depth/image_rect_raw", stamp, sensors.toImageMessage(tick, stamp));
      bag.write("/camera/depth/camera_info", stamp, sensors.toCameraMessage(stamp));
    }
  }
}

void writeDrive(const DriveConfig& config, bool has_all_sensors, BagOutput& bag) {
  const SimulatedDrive drive(config);
  const SimulatedSensors others(config);
  const std::uint64_t count = computeNumClouds(config);
  tf2_msgs::TFMessage mount;
  if (has_all_sensors) mount.transforms = others.toMountMessages(kFirstStamp);
  mount.transforms.push_back(drive.toMountMessage(kFirstStamp));
  bag.writeLatched("/tf_static", kFirstStamp, mount, std::string("/") + kName);
  cuboid_mapping::ProgressBar progress("clouds", count);
  for (std::uint64_t i = 0; i < count; ++i) {
    cuboid_mapping::throwIfInterrupted();
    const ros::Time stamp = computeStamp(kFirstStamp, i, config.cloud_rate_hz);
    tf2_msgs::TFMessage pose;
    pose.transforms.push_back(drive.toPoseMessage(i, stamp));
    bag.writeCloud("/cloud", drive.toCloudMessage(i, stamp), pose);
    if (has_all_sensors) writeOthers(others, i, bag);
    progress.update(i + 1);
  }
}

int runNode(int argc, char** argv) {
  ros::init(argc, argv, kName);
  ros::NodeHandle node;
  std::vector<std::string> errors;
  const SimulatedLidarParameters parameters = loadParameters(ros::NodeHandle("~"), errors);
  for (const std::string& error : errors) ROS_FATAL("parameter ~%s", error.c_str());
  if (!errors.empty()) return 1;
  runSimulatedLidar(node, parameters);
  return 0;
}

int runBag(int argc, char** argv) {
  std::string file;
  DriveConfig config;
  bool has_all_sensors = false;
  cuboid_mapping::CommandLine line(
      kName,
      "A lidar that drives through a simulated building.\n"
      "Without --bag it is a ROS node; its private parameters are seed, rings, columns,\n"
      "min_elevation, max_elevation, noise, max_range, cloud_rate, duration, robot, door, "
      "head_start,\n"
      "publish_clock, rate, follow_path and speed, as in _seed:=2.\n"
      "With --bag it writes the same messages to a file, and needs no ROS master.");
  line.addText("bag", file, "rosbag to write, or to replace");
  line.addNumber("duration", config.duration_s,
                 "seconds of simulated time; a bag needs more than 0");
  line.addNumber("seed", config.seed, "seed for the furniture, the walking person and the noise");
  line.addNumber("rings", config.lidar.rings, "number of beams, one above the other");
  line.addNumber("columns", config.lidar.columns, "number of beams per revolution");
  line.addNumber("noise", config.lidar.range_noise_m, "standard deviation of ranges in m");
  line.addNumber("max-range", config.lidar.max_range_m, "longest range with a return in m");
  line.addNumber("cloud-rate", config.cloud_rate_hz, "clouds per second");
  line.addText("robot", config.robot, "name of the robot, the prefix of its frames");
  line.addNumber("head-start", config.head_start_m,
                 "distance that the robot has driven at the start, in metres");
  line.addFlag("all-sensors", has_all_sensors,
               "add a second lidar, a planar laser at twice the rate, and a depth camera at three "
               "times the rate");
  if (const auto status = line.parse(argc, argv)) return *status;
  if (file.empty()) throw std::runtime_error(argv[1] + std::string(" requires --bag"));
  checkBagConfig(config);
  cuboid_mapping::catchInterrupts();
  writeBag(file, [&](BagOutput& bag) { writeDrive(config, has_all_sensors, bag); });
  const std::uint64_t count = computeNumClouds(config);
  std::cout << file << ": " << cuboid_mapping::counted(count, "cloud") << ", "
            << static_cast<double>(count) / config.cloud_rate_hz << " s" << std::endl;
  return 0;
}

/// Whether to run as a node: without arguments, or with ROS arguments NAME:=VALUE only.
bool isNode(int argc, char** argv) {
  std::vector<std::string> others;
  ros::removeROSArgs(argc, argv, others);
  return others.size() <= 1;
}

}  // namespace
}  // namespace cuboid_mapping_ros

int main(int argc, char** argv) {
  using namespace cuboid_mapping_ros;
  return cuboid_mapping::runProgram(
      kName, [&] { return isNode(argc, argv) ? runNode(argc, argv) : runBag(argc, argv); });
}
