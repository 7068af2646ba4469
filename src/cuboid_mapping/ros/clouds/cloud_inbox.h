// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/clouds/cloud_queue.h"

#include <ros/callback_queue_interface.h>

#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <vector>

namespace cuboid_mapping_ros {

/// Clouds on their way from the thread that receives them to the queue where they are worked on.
///
/// The queue of a roscpp subscription counts messages, and drops without a word: a hundred clouds of
/// 10 MB while one cloud is worked on. Therefore each message goes from roscpp's network thread into this
/// inbox at once, which counts bytes, and tells how many clouds it has dropped, the oldest first.
///
/// Thread rule: put() from any thread; the callbacks run on the callback queue.
class CloudInbox {
 public:
  struct Callbacks {
    std::function<void(const SensorMessage& cloud)> take;
    /// So many of a source, before the clouds that came after them.
    std::function<void(std::size_t source, std::size_t count)> drop;
  };

  /// @param callback_queue  Must outlive this object.
  /// @param callbacks  Must not throw.
  CloudInbox(ros::CallbackQueueInterface& callback_queue, const CloudLimits& limits,
             Callbacks callbacks);
  ~CloudInbox();
  CloudInbox(const CloudInbox&) = delete;
  CloudInbox& operator=(const CloudInbox&) = delete;

  /// For want of memory a cloud is dropped and counted; or the exception says that clouds are delivered with
  /// the next one only.
  void put(const SensorMessage& cloud);

  [[nodiscard]] std::size_t numBytes() const;

 private:
  void deliver();

  ros::CallbackQueueInterface& callback_queue_;
  CloudLimits limits_;
  Callbacks callbacks_;
  mutable std::mutex mutex_;
  std::deque<SensorMessage> clouds_;
  std::size_t num_bytes_ = 0;
  std::vector<std::size_t> num_dropped_;  ///< Of each source, since the last delivery.
  bool is_delivery_due_ = false;
};

}  // namespace cuboid_mapping_ros
