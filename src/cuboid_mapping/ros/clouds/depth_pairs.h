// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/conversions/sensor_message.h"

#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <utility>

namespace cuboid_mapping_ros {

/// Brings depth images together with the camera_info of the same stamp, whichever comes first. Needs no
/// master. Unlike message_filters::TimeSynchronizer it counts images that are left alone, and goes on when stamps
/// jump back. Thread-safe; what it calls runs in the thread that adds.
class DepthPairs {
 public:
  struct Callbacks {
    std::function<void(const DepthImage& depth)> take;
    /// The oldest of too many images that wait for their camera_info has gone. Must not throw.
    std::function<void()> drop;
  };

  /// Images, and camera_info, that wait for each other.
  static constexpr std::size_t kMaxWaiting = 10;

  explicit DepthPairs(Callbacks callbacks) : callbacks_(std::move(callbacks)) {}
  DepthPairs(const DepthPairs&) = delete;
  DepthPairs& operator=(const DepthPairs&) = delete;

  void add(const sensor_msgs::Image::ConstPtr& image);
  void add(const sensor_msgs::CameraInfo::ConstPtr& camera);

 private:
  Callbacks callbacks_;
  std::mutex mutex_;
  std::deque<sensor_msgs::Image::ConstPtr> images_;
  std::deque<sensor_msgs::CameraInfo::ConstPtr> cameras_;
};

}  // namespace cuboid_mapping_ros
