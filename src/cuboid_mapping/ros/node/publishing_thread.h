// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/middleware/callback_guard.h"

#include <ros/node_handle.h>
#include <ros/wall_timer.h>

#include <atomic>
#include <functional>

namespace cuboid_mapping_ros {

/// The thread that publishes the map: at a rate, and soon after a change that no cloud has made. Thread-safe.
class PublishingThread {
 public:
  /// @param publish  Called in the thread.
  PublishingThread(CallbackGuard& guard, std::function<void()> publish);

  [[nodiscard]] GuardedQueue& queue() { return thread_.queue(); }
  void start(const ros::NodeHandle& nh, double rate_hz);
  void stop() { thread_.stop(); }
  void setRate(double rate_hz);
  void publishSoon();

 private:
  std::function<void()> publish_;
  std::atomic<bool> is_due_{false};  ///< publishSoon() has been called.
  GuardedThread thread_;
  ros::WallTimer timer_;
};

}  // namespace cuboid_mapping_ros
