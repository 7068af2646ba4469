// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/middleware/callback_guard.h"
#include "cuboid_mapping/ros/middleware/callbacks.h"

#include <ros/node_handle.h>

#include <atomic>
#include <functional>

namespace cuboid_mapping_ros {

/// The thread that publishes the map after changes, at most at a rate. Thread-safe.
///
/// With the last publication a period ago, a change is published at once; else a period after it, by a timer. A timer alone
/// would let each cloud wait for half a period on average, and for a whole one at worst.
class PublishingThread {
 public:
  /// @param publish  Called in the thread.
  PublishingThread(CallbackGuard& guard, std::function<void()> publish);

  [[nodiscard]] GuardedQueue& queue() { return thread_.queue(); }
  void start(const ros::NodeHandle& nh, double rate_hz);
  void stop() { thread_.stop(); }
  void setRate(double rate_hz);
  /// Publishes a change.
  void publishSoon();

 private:
  void publish();
  [[nodiscard]] ros::WallDuration timerPeriod() const;

  std::function<void()> publish_;
  std::atomic<bool> is_due_{false};  ///< publishSoon() has been called.
  std::atomic<double> period_s_{0.0};
  std::atomic<double> last_s_{-1e9};  ///< Time of the last publication, see steadySeconds().
  GuardedThread thread_;
  Timer timer_;
};

}  // namespace cuboid_mapping_ros
