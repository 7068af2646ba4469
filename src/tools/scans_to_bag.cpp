// SPDX-License-Identifier: BSD-3-Clause
// Converts a data set of scans to a rosbag: a PointCloud2 and its tf for each scan.
#include "bag_output.h"
#include "command_line.h"
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/conversions/points.h"
#include "progress_bar.h"
#include "scan_messages.h"
#include "stamps.h"
#include "transform_message.h"

#include <ros/names.h>

#include <algorithm>
#include <cstdint>
#include <iostream>
#include <limits>
#include <stdexcept>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::counted;
using cuboid_mapping::ScanDataset;

struct Options {
  std::string dataset;
  std::string bag;
  std::string bin_row;
  double rate_hz = kScanRate_hz;
  ScanNames names;
  std::size_t max_clouds = std::numeric_limits<std::size_t>::max();
};

void checkFrame(const char* option, const std::string& frame) {
  if (frame.empty() || frame[0] == '/') {
    throw std::runtime_error(std::string(option) + " '" + frame +
                             "': must be a name that does not start with /");
  }
}

void checkOptions(const Options& options) {
  std::string reason;
  if (options.names.topic.empty() || !ros::names::validate(options.names.topic, reason)) {
    throw std::runtime_error("--topic '" + options.names.topic + "': is not a valid topic name");
  }
  checkFrame("--map-frame", options.names.map_frame);
  checkFrame("--sensor-frame", options.names.sensor_frame);
  if (options.names.map_frame == options.names.sensor_frame) {
    throw std::runtime_error("--map-frame and --sensor-frame must differ");
  }
}

/// @return Number of points.
std::uint64_t writeClouds(const ScanDataset& dataset, std::uint64_t count, const Options& options,
                          BagOutput& bag) {
  std::uint64_t num_points = 0;
  cuboid_mapping::ProgressBar progress("clouds", count);
  for (std::uint64_t i = 0; i < count; ++i) {
    cuboid_mapping::throwIfInterrupted();
    const ScanDataset::Item scan = dataset.read(i);
    const ros::Time stamp = computeStamp(kFirstStamp, i, options.rate_hz);
    tf2_msgs::TFMessage tf;
    tf.transforms.push_back(toTransformMessage(scan.T_map_sensor, stamp, options.names.map_frame,
                                               options.names.sensor_frame));
    bag.writeCloud(options.names.topic,
                   toCloud(scan.points_sensor, makeHeader(options.names.sensor_frame, stamp)), tf);
    num_points += scan.points_sensor.size();
    progress.update(i + 1);
  }
  return num_points;
}

int convert(const Options& options) {
  checkOptions(options);
  const std::unique_ptr<ScanDataset> dataset = cuboid_mapping::openScanDataset(
      options.dataset, cuboid_mapping::parseBinRow(options.bin_row));
  const std::uint64_t count = std::min<std::uint64_t>(options.max_clouds, dataset->size());
  std::uint64_t num_points = 0;
  writeBag(options.bag,
           [&](BagOutput& bag) { num_points = writeClouds(*dataset, count, options, bag); });
  std::cout << options.bag << ": " << counted(count, "cloud") << ", "
            << counted(num_points, "point") << ", " << static_cast<double>(count) / options.rate_hz
            << " s" << std::endl;
  return 0;
}

int run(int argc, char** argv) {
  Options options;
  cuboid_mapping::CommandLine line(
      "scans_to_bag",
      "Converts a data set of scans to a rosbag with sensor_msgs/PointCloud2 and tf.");
  line.addArgument(
      "dataset", options.dataset,
      "a folder with poses.txt and scans/NNNN.pcd or .bin files, one with pcd/*.pcd, or an OctoMap "
      ".graph file");
  line.addArgument("bag", options.bag, "rosbag to write; an existing file is replaced");
  line.addNumber("rate", options.rate_hz, "clouds per second of bag time", {0.001, 1000.0});
  line.addText("topic", options.names.topic, "topic of the clouds");
  line.addText("map-frame", options.names.map_frame, "parent frame of tf");
  line.addText("sensor-frame", options.names.sensor_frame,
               "frame of the clouds, child frame of tf");
  line.addText("bin-row", options.bin_row, cuboid_mapping::kBinRowHelp);
  line.addNumber("clouds", options.max_clouds, "only the first N clouds", {1});
  if (const auto status = line.parse(argc, argv)) return *status;
  return convert(options);
}

}  // namespace
}  // namespace cuboid_mapping_ros

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("scans_to_bag", argc, argv, cuboid_mapping_ros::run);
}
