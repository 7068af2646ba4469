// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/clouds/depth_pairs.h"

#include <algorithm>
#include <cmath>

namespace cuboid_mapping_ros {

double stampDistance(const ros::Time& camera, const ros::Time& image) {
  return camera.isZero() ? 0.0 : std::abs(camera.toSec() - image.toSec());
}

void DepthPairs::add(const sensor_msgs::Image::ConstPtr& image) {
  images_.push_back(image);
  ++num_images_since_camera_;
  const auto waits = [this] {
    if (cameras_.empty()) return images_.size() <= kMaxCameras;
    const ros::Time& newest = cameras_.back()->header.stamp;
    const bool may_come = !newest.isZero() && newest < images_.front()->header.stamp &&
                          num_images_since_camera_ <= kMaxWaiting;
    return may_come && images_.size() <= kMaxWaiting;
  };
  while (!images_.empty() && !waits()) takeOldest();
}

void DepthPairs::add(const sensor_msgs::CameraInfo::ConstPtr& camera) {
  cameras_.push_back(camera);
  if (cameras_.size() > kMaxCameras) cameras_.pop_front();
  num_images_since_camera_ = 0;
  const ros::Time& stamp = camera->header.stamp;
  while (!images_.empty() && (stamp.isZero() || stamp >= images_.front()->header.stamp)) {
    takeOldest();
  }
}

void DepthPairs::takeOldest() {
  const auto image = images_.front();
  images_.pop_front();
  if (cameras_.empty()) return callbacks_.drop();
  const ros::Time& stamp = image->header.stamp;
  const auto nearest =
      std::min_element(cameras_.begin(), cameras_.end(), [&stamp](const auto& a, const auto& b) {
        return stampDistance(a->header.stamp, stamp) < stampDistance(b->header.stamp, stamp);
      });
  callbacks_.take({image, *nearest});
}

}  // namespace cuboid_mapping_ros
