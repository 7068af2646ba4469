// SPDX-License-Identifier: BSD-3-Clause
#include "dataset.h"

#include "command_line.h"
#include "progress_bar.h"

#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/conversions/cloud_conversions.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"

#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/PointCloud2.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <iostream>
#include <set>
#include <stdexcept>

namespace cuboid_mapping::bench {
namespace {

using cuboid_mapping_ros::CloudError;
using cuboid_mapping_ros::CloudPoints;

/// Topics of the bag that have clouds.
std::set<std::string> findCloudTopics(const rosbag::Bag& bag) {
  std::set<std::string> topics;
  rosbag::View view(bag, rosbag::TypeQuery("sensor_msgs/PointCloud2"));
  for (const rosbag::ConnectionInfo* connection : view.getConnections()) {
    topics.insert(connection->topic);
  }
  return topics;
}

std::string chooseTopic(const rosbag::Bag& bag, const DatasetChoice& choice) {
  const std::set<std::string> topics = findCloudTopics(bag);
  if (topics.empty()) {
    throw std::runtime_error(choice.path + " has no topic of sensor_msgs/PointCloud2");
  }
  if (choice.cloud_topic.empty() && topics.size() == 1) return *topics.begin();
  if (topics.count(choice.cloud_topic) > 0) return choice.cloud_topic;
  std::string names;
  for (const std::string& topic : topics) names += (names.empty() ? "" : ", ") + topic;
  throw std::runtime_error(choice.path +
                           (choice.cloud_topic.empty()
                                ? " has more than one topic of clouds"
                                : " has no clouds on '" + choice.cloud_topic + "'") +
                           ": choose --cloud-topic from " + names);
}

void readTransforms(const rosbag::Bag& bag, tf2::BufferCore& buffer) {
  const std::vector<std::string> topics{"/tf", "tf", "/tf_static", "tf_static"};
  rosbag::View view(bag, rosbag::TopicQuery(topics));
  for (const rosbag::MessageInstance& instance : view) {
    const auto message = instance.instantiate<tf2_msgs::TFMessage>();
    if (!message) continue;
    const bool is_static = instance.getTopic().find("static") != std::string::npos;
    for (geometry_msgs::TransformStamped transform : message->transforms) {
      // tf2 takes no leading slashes, which old drivers write.
      transform.header.frame_id = cuboid_mapping_ros::withoutSlash(transform.header.frame_id);
      transform.child_frame_id = cuboid_mapping_ros::withoutSlash(transform.child_frame_id);
      buffer.setTransform(transform, "bag", is_static);
    }
  }
}

/// Converts clouds, and remembers why some were left out.
class CloudReader {
 public:
  CloudReader(const tf2::BufferCore& buffer, std::string map_frame)
      : buffer_(buffer), map_frame_(std::move(map_frame)) {}

  void read(const sensor_msgs::PointCloud2& message, std::vector<Scan>& scans) {
    const auto cloud = cuboid_mapping_ros::convertCloud(message);
    if (const auto* error = std::get_if<CloudError>(&cloud)) return skip(error->text);
    const auto lookup = cuboid_mapping_ros::lookupTransform(
        buffer_, map_frame_, message.header.frame_id, message.header.stamp);
    if (!lookup.T_target_source) return skip(lookup.error);
    scans.push_back(toScan(std::get<CloudPoints>(cloud), *lookup.T_target_source,
                           lookup.T_target_source->translation()));
  }

  [[nodiscard]] std::size_t numSkipped() const { return num_skipped_; }
  [[nodiscard]] const std::string& firstReason() const { return first_reason_; }

 private:
  void skip(const std::string& reason) {
    if (num_skipped_++ == 0) first_reason_ = reason;
  }

  const tf2::BufferCore& buffer_;
  std::string map_frame_;
  std::size_t num_skipped_ = 0;
  std::string first_reason_;
};

std::vector<Scan> readClouds(const rosbag::Bag& bag, const DatasetChoice& choice) {
  tf2::BufferCore buffer(ros::Duration(1e6));  // long enough for any bag
  readTransforms(bag, buffer);
  CloudReader reader(buffer, choice.map_frame);
  std::vector<Scan> scans;
  rosbag::View view(bag, rosbag::TopicQuery(chooseTopic(bag, choice)));
  {
    ProgressBar progress(
        "clouds read",
        std::max<std::size_t>(1, std::min<std::size_t>(view.size(), choice.max_scans)));
    for (const rosbag::MessageInstance& instance : view) {
      throwIfInterrupted();
      if (scans.size() == choice.max_scans) break;
      if (const auto message = instance.instantiate<sensor_msgs::PointCloud2>()) {
        reader.read(*message, scans);
      }
      progress.update(scans.size());
    }
  }
  if (scans.empty()) {
    throw std::runtime_error(
        choice.path + ": none of its clouds can be used; the first: " + reader.firstReason());
  }
  if (reader.numSkipped() > 0) {
    std::cerr << "compare_maps: " << counted(reader.numSkipped(), "cloud")
              << " skipped; the first: " << reader.firstReason() << std::endl;
  }
  return scans;
}

}  // namespace

std::vector<Scan> readBagScans(const DatasetChoice& choice) {
  try {
    return readClouds(rosbag::Bag(choice.path), choice);
  } catch (const rosbag::BagException& error) {
    throw std::runtime_error("cannot read " + choice.path + " as a rosbag: " + error.what());
  }
}

}  // namespace cuboid_mapping::bench
