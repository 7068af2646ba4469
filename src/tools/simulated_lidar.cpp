// SPDX-License-Identifier: BSD-3-Clause
// A lidar that drives through a simulated building: as a node, or written to a rosbag.
#include "bag_output.h"
#include "command_line.h"
#include "progress_bar.h"
#include "simulated_drive.h"
#include "simulated_lidar_node.h"
#include "stamps.h"

#include <ros/ros.h>

#include <algorithm>
#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

constexpr char kName[] = "simulated_lidar";

/// @throws std::runtime_error with all that is wrong.
void checkBagConfig(const DriveConfig& config) {
  std::string text;
  for (const std::string& error : checkDriveConfig(config)) text += error + "; ";
  if (config.duration_s == 0.0) text += "duration = 0: a bag needs an end; ";
  if (!text.empty()) throw std::runtime_error(text.substr(0, text.size() - 2));
}

int writeBag(const std::string& file, const DriveConfig& config) {
  checkBagConfig(config);
  const SimulatedDrive drive(config);
  const std::uint64_t count = computeNumClouds(config);
  BagOutput bag(file);
  tf2_msgs::TFMessage mount;
  mount.transforms.push_back(drive.toMountMessage(kFirstStamp));
  bag.writeLatched("/tf_static", kFirstStamp, mount, std::string("/") + kName);
  {
    cuboid_mapping::ProgressBar progress("clouds", count);
    for (std::uint64_t i = 0; i < count; ++i) {
      cuboid_mapping::throwIfInterrupted();
      const ros::Time stamp = computeStamp(kFirstStamp, i, config.cloud_rate_hz);
      tf2_msgs::TFMessage pose;
      pose.transforms.push_back(drive.toPoseMessage(i, stamp));
      bag.writeCloud("/cloud", drive.toCloudMessage(i, stamp), pose);
      progress.update(i + 1);
    }
  }
  bag.commit();
  std::cout << file << ": " << count << " clouds, "
            << static_cast<double>(count) / config.cloud_rate_hz << " s" << std::endl;
  return 0;
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
  auto seed = static_cast<std::int64_t>(config.seed);  // CLI11 takes -1 for an unsigned number, too
  CLI::App app(
      "A lidar that drives through a simulated building.\n"
      "Without --bag it is a ROS node; its private parameters are seed, rings, columns, noise, "
      "max_range, cloud_rate, duration, publish_clock and rate, as in _seed:=2.\n"
      "With --bag it writes the same messages to a file, and needs no ROS master.",
      kName);
  CLI::Option* const bag = app.add_option("--bag", file, "rosbag to write, or to replace");
  const auto add = [&](const std::string& name, auto& value, const std::string& help) {
    return app.add_option(name, value, help)->needs(bag)->capture_default_str();
  };
  add("--duration", config.duration_s, "seconds of simulated time, more than 0");
  add("--seed", seed, "of furniture, walker and noise");
  add("--rings", config.lidar.rings, "beams above each other");
  add("--columns", config.lidar.columns, "beams in a revolution");
  add("--noise", config.lidar.range_noise_m, "standard deviation of ranges in m");
  add("--max-range", config.lidar.max_range_m, "no return from beyond, in m");
  add("--cloud-rate", config.cloud_rate_hz, "clouds per second");
  if (const auto status = cuboid_mapping::parseCommandLine(app, argc, argv)) return *status;
  if (seed < 0) throw std::runtime_error("seed = " + std::to_string(seed) + ": must be 0 or more");
  config.seed = static_cast<std::uint64_t>(seed);
  cuboid_mapping::catchInterrupts();
  return writeBag(file, config);
}

/// A node is started with nothing, or with arguments of ROS only: NAME:=VALUE.
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
