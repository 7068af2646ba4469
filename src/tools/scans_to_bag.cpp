// SPDX-License-Identifier: BSD-3-Clause
// Makes a rosbag of a data set of scans: a PointCloud2 and its tf for each of them.
#include "bag_output.h"
#include "command_line.h"
#include "cuboid_mapping/io/scan_dataset.h"
#include "cuboid_mapping/io/text.h"
#include "progress_bar.h"
#include "stamps.h"

#include <ros/names.h>
#include <sensor_msgs/point_cloud2_iterator.h>
#include <tf2_eigen/tf2_eigen.h>

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
  double rate_hz = 10.0;
  std::string topic = "/cloud";
  std::string map_frame = "map";
  std::string sensor_frame = "sensor";
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
  if (options.topic.empty() || !ros::names::validate(options.topic, reason)) {
    throw std::runtime_error("--topic '" + options.topic + "': is not a valid topic name");
  }
  checkFrame("--map-frame", options.map_frame);
  checkFrame("--sensor-frame", options.sensor_frame);
  if (options.map_frame == options.sensor_frame) {
    throw std::runtime_error("--map-frame and --sensor-frame must differ");
  }
}

tf2_msgs::TFMessage toTfMessage(const Eigen::Isometry3d& T_map_sensor, const ros::Time& stamp,
                                const Options& options) {
  tf2_msgs::TFMessage message;
  message.transforms.push_back(tf2::eigenToTransform(T_map_sensor));
  geometry_msgs::TransformStamped& transform = message.transforms.front();
  transform.header.stamp = stamp;
  transform.header.frame_id = options.map_frame;
  transform.child_frame_id = options.sensor_frame;
  return message;
}

sensor_msgs::PointCloud2 toCloudMessage(const std::vector<Eigen::Vector3f>& points,
                                        const ros::Time& stamp, const std::string& frame) {
  sensor_msgs::PointCloud2 message;
  message.header.stamp = stamp;
  message.header.frame_id = frame;
  message.is_dense =
      std::all_of(points.begin(), points.end(), [](const auto& p) { return p.allFinite(); });
  sensor_msgs::PointCloud2Modifier modifier(message);
  using Field = sensor_msgs::PointField;
  modifier.setPointCloud2Fields(3, "x", 1, Field::FLOAT32, "y", 1, Field::FLOAT32, "z", 1,
                                Field::FLOAT32);
  modifier.resize(points.size());
  sensor_msgs::PointCloud2Iterator<float> xyz(message, "x");
  for (const Eigen::Vector3f& point : points) {
    std::copy_n(point.data(), 3, &xyz[0]);
    ++xyz;
  }
  return message;
}

int convert(const Options& options) {
  checkOptions(options);
  const std::unique_ptr<ScanDataset> dataset = cuboid_mapping::openScanDataset(options.dataset);
  const std::uint64_t count = std::min<std::uint64_t>(options.max_clouds, dataset->size());
  std::uint64_t num_points = 0;
  BagOutput bag(options.bag);
  {
    cuboid_mapping::ProgressBar progress("clouds", count);
    for (std::uint64_t i = 0; i < count; ++i) {
      cuboid_mapping::throwIfInterrupted();
      const ScanDataset::Item scan = dataset->read(i);
      const ros::Time stamp = computeStamp(kFirstStamp, i, options.rate_hz);
      bag.writeCloud(options.topic, toCloudMessage(scan.points_sensor, stamp, options.sensor_frame),
                     toTfMessage(scan.T_map_sensor, stamp, options));
      num_points += scan.points_sensor.size();
      progress.update(i + 1);
    }
  }
  bag.commit();
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
  line.addArgument("dataset", options.dataset,
                   "a folder with poses.txt and scans/NNNN.pcd, or an OctoMap .graph file");
  line.addArgument("bag", options.bag, "rosbag to write; an existing file is replaced");
  line.addNumber("rate", options.rate_hz, "clouds per second of bag time", {0.001, 1000.0});
  line.addText("topic", options.topic, "topic of the clouds");
  line.addText("map-frame", options.map_frame, "parent frame of tf");
  line.addText("sensor-frame", options.sensor_frame, "frame of the clouds, child frame of tf");
  line.addNumber("clouds", options.max_clouds, "only the first N clouds", {1});
  if (const auto status = line.parse(argc, argv)) return *status;
  return convert(options);
}

}  // namespace
}  // namespace cuboid_mapping_ros

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("scans_to_bag", argc, argv, cuboid_mapping_ros::run);
}
