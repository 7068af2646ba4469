// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/conversions/sensor_message.h"

#include <cstddef>
#include <deque>
#include <functional>

namespace cuboid_mapping_ros {

/// Finds the camera_info of each depth image. Needs no master.
///
/// That of the image's stamp, if there is one. Else one without stamp, or the nearest by stamp: of a camera that does not
/// change they are the same, whether they come 3 ms later, or once. message_filters has no policy for these: its
/// synchronizers want a pair of stamps for each image.
///
/// An image waits until a camera_info that is not earlier has come; no longer than for kMaxWaiting other images, and not
/// at all when none has come since as many images. Before the first camera_info, kMaxCameras images wait. Not thread-safe.
class DepthPairs {
 public:
  struct Callbacks {
    std::function<void(const DepthImage& depth)> take;
    std::function<void()> drop;  ///< An image, for want of any camera_info. Must not throw.
  };

  static constexpr std::size_t kMaxWaiting = 3;
  static constexpr std::size_t kMaxCameras = 10;

  explicit DepthPairs(Callbacks callbacks) : callbacks_(std::move(callbacks)) {}

  void add(const sensor_msgs::Image::ConstPtr& image);
  void add(const sensor_msgs::CameraInfo::ConstPtr& camera);

 private:
  void takeOldest();

  Callbacks callbacks_;
  std::deque<sensor_msgs::Image::ConstPtr> images_;  ///< That wait.
  std::deque<sensor_msgs::CameraInfo::ConstPtr> cameras_;
  std::size_t num_images_since_camera_ = 0;
};

/// Seconds between the stamp of a camera_info and that of an image; 0 where the camera_info has none.
[[nodiscard]] double stampDistance(const ros::Time& camera, const ros::Time& image);

}  // namespace cuboid_mapping_ros
