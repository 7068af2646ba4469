// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/clouds/depth_pairs.h"

#include <algorithm>

namespace cuboid_mapping_ros {
namespace {

/// Takes the message of a stamp out of those that wait; null when there is none.
template <typename MessageT>
MessageT takeOf(const ros::Time& stamp, std::deque<MessageT>& waiting) {
  const auto found =
      std::find_if(waiting.begin(), waiting.end(),
                   [&stamp](const MessageT& message) { return message->header.stamp == stamp; });
  if (found == waiting.end()) return {};
  MessageT message = *found;
  waiting.erase(found);
  return message;
}

}  // namespace

void DepthPairs::add(const sensor_msgs::Image::ConstPtr& image) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto camera = takeOf(image->header.stamp, cameras_);
  if (camera) return callbacks_.take({image, camera});
  images_.push_back(image);
  if (images_.size() <= kMaxWaiting) return;
  images_.pop_front();
  callbacks_.drop();
}

void DepthPairs::add(const sensor_msgs::CameraInfo::ConstPtr& camera) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto image = takeOf(camera->header.stamp, images_);
  if (image) return callbacks_.take({image, camera});
  cameras_.push_back(camera);
  if (cameras_.size() > kMaxWaiting) cameras_.pop_front();
}

}  // namespace cuboid_mapping_ros
