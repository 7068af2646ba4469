// SPDX-License-Identifier: BSD-3-Clause
#include "bag_sources.h"

#include "bag_topics.h"
#include "cuboid_mapping/ros/conversions/compressed_depth.h"
#include "cuboid_mapping/ros/mapping/source_subscriber.h"
#include "cuboid_mapping/ros/middleware/rate_limit.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

/// The camera_info nearest to a stamp, as DepthPairs finds it. @pre There is one.
std::size_t nearestCamera(const std::map<ros::Time, std::size_t>& cameras, const ros::Time& stamp) {
  const auto after = cameras.lower_bound(stamp);
  if (after == cameras.begin()) return after->second;
  const auto before = std::prev(after);
  const bool is_after = after != cameras.end() &&
                        stampDistance(after->first, stamp) < stampDistance(before->first, stamp);
  return (is_after ? after : before)->second;
}

sensor_msgs::Image::ConstPtr readImage(BagFiles& bags, const BagMessage& instance) {
  if (!isCompressed(instance.instance.getTopic())) return bags.read<sensor_msgs::Image>(instance);
  const auto image = bags.read<sensor_msgs::CompressedImage>(instance);
  return image ? toCompressedImage(*image) : nullptr;
}

}  // namespace

BagMessages::BagMessages(BagFiles& bags, const NodeParameters& parameters)
    : bags_(bags), sources_(sourcesOf(parameters)) {
  for (std::size_t source = 0; source < sources_.size(); ++source) add(source);
  if (sources_.size() == 1) return;
  std::stable_sort(messages_.begin(), messages_.end(), [](const Message& a, const Message& b) {
    return std::make_pair(a.stamp, a.source) < std::make_pair(b.stamp, b.source);
  });
}

/// @return The instances, in the order of recording.
BagMessages::Range BagMessages::collect(const std::string& topic) {
  const std::string name = withSlash(topic);
  const std::size_t first = instances_.size();
  for (const BagMessage& message : bags_.collect({name, name.substr(1)})) {
    instances_.push_back(message);
  }
  return {first, instances_.size()};
}

void BagMessages::add(std::size_t source) {
  const SourceParameters& parameters = sources_[source];
  const bool is_depth = parameters.type == SourceType::kDepthImage;
  const bool has_info = !parameters.camera_info.empty();
  const Range range = collect(parameters.topic);
  Range cameras{};
  if (is_depth) {
    cameras =
        collect(has_info ? parameters.camera_info : cameraInfoBeside(withSlash(parameters.topic)));
  }
  std::map<ros::Time, std::size_t> camera_at;
  std::map<ros::Time, std::size_t> uncalibrated_at;
  for (std::size_t i = cameras.first; i < cameras.second; ++i) {
    const auto camera = bags_.read<sensor_msgs::CameraInfo>(instances_[i]);
    if (!camera) continue;
    (hasFocalLength(*camera) ? camera_at : uncalibrated_at).emplace(camera->header.stamp, i);
  }
  if (camera_at.empty()) camera_at.swap(uncalibrated_at);  // The refusal of the images says why.
  const bool needs_stamp = is_depth || sources_.size() > 1 || parameters.max_rate_hz > 0.0;
  RateLimit rate_limit(parameters.max_rate_hz);
  for (std::size_t i = range.first; i < range.second; ++i) {
    const ros::Time stamp = needs_stamp ? bags_.readStamp(instances_[i]) : ros::Time();
    if (is_depth && camera_at.empty()) {
      ++num_without_camera_;
    } else if (rate_limit.allows(stamp)) {
      messages_.push_back({source, i, is_depth ? nearestCamera(camera_at, stamp) : 0,
                           stamp.isZero() ? instances_[i].instance.getTime() : stamp});
    }
  }
}

std::optional<SensorMessage> BagMessages::read(std::size_t number) const {
  const Message& message = messages_.at(number);
  const BagMessage& instance = instances_[message.instance];
  switch (sources_[message.source].type) {
    case SourceType::kPointCloud:
      if (const auto cloud = bags_.read<sensor_msgs::PointCloud2>(instance)) {
        return SensorMessage{cloud, message.source};
      }
      return std::nullopt;
    case SourceType::kLaserScan:
      if (const auto scan = bags_.read<sensor_msgs::LaserScan>(instance)) {
        return SensorMessage{scan, message.source};
      }
      return std::nullopt;
    case SourceType::kDepthImage: break;
  }
  const auto image = readImage(bags_, instance);
  const auto camera = bags_.read<sensor_msgs::CameraInfo>(instances_[message.camera]);
  if (!image || !camera) return std::nullopt;
  return SensorMessage{DepthImage{image, camera}, message.source};
}

}  // namespace cuboid_mapping_ros
