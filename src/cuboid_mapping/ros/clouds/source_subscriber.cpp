// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/clouds/source_subscriber.h"

#include <utility>

namespace cuboid_mapping_ros {
namespace {

/// Messages that roscpp keeps, and beyond which it drops them without telling. It never has that many:
/// each is put into CloudInbox as it arrives, whose bounds are those that count.
constexpr std::uint32_t kReceiveQueueSize = 100;

}  // namespace

std::string cameraInfoBeside(const std::string& image_topic) {
  return image_topic.substr(0, image_topic.rfind('/') + 1) + "camera_info";
}

SourceSubscriber::SourceSubscriber(const ros::NodeHandle& nh, const NodeParameters& source,
                                   std::size_t index, const Take& take)
    : nh_(nh), topic_(nh.resolveName(source.source.topic)) {
  const auto pass_on = [index, take](const auto& message) { take({message, index}); };
  switch (source.source.type) {
    case SourceType::kPointCloud:
      listen<sensor_msgs::PointCloud2>(source.source.topic, pass_on);
      break;
    case SourceType::kLaserScan:
      listen<sensor_msgs::LaserScan>(source.source.topic, pass_on);
      break;
    case SourceType::kDepthImage: listenToDepth(source.source, pass_on); break;
  }
}

void SourceSubscriber::listenToDepth(const SourceParameters& source,
                                     const std::function<void(const DepthImage&)>& take) {
  pairs_ =
      std::make_unique<DepthPairs>(DepthPairs::Callbacks{take, [this] { ++num_without_camera_; }});
  const auto pair_up = [this](const auto& message) { pairs_->add(message); };
  listen<sensor_msgs::Image>(source.topic, pair_up);
  const bool is_beside = source.camera_info.empty();
  listen<sensor_msgs::CameraInfo>(is_beside ? cameraInfoBeside(topic_) : source.camera_info,
                                  pair_up);
}

template <typename MessageT, typename WorkT>
void SourceSubscriber::listen(const std::string& topic, const WorkT& work) {
  // One by one, what comes while another is taken would stay.
  ros::SubscribeOptions options;
  options.init<MessageT>(topic, kReceiveQueueSize, work);
  options.allow_concurrent_callbacks = true;
  subscribers_.push_back(nh_.subscribe(options));
}

}  // namespace cuboid_mapping_ros
