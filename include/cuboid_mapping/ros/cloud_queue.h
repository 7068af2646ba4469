// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/callback_queue_interface.h>
#include <sensor_msgs/PointCloud2.h>

#include <cstddef>
#include <deque>
#include <functional>

namespace cuboid_mapping_ros {

/// Clouds that wait for their turn on a callback queue.
///
/// One turn handles one cloud, and the next turn comes after all that was in the callback queue
/// before: services are answered, and new clouds are received, between two clouds. So this queue is
/// the one that overflows when the node is too slow, and it tells about every cloud that it drops;
/// the queue of a roscpp subscription does not.
///
/// Thread rule: push() and the callbacks run on the callback queue, one after the other.
class CloudQueue {
 public:
  using CloudPtr = sensor_msgs::PointCloud2::ConstPtr;
  using Callback = std::function<void(const CloudPtr&)>;

  /// @param callback_queue  Must outlive this object.
  /// @param max_size  Clouds that may wait, > 0.
  /// @param handle    Called for each cloud in its turn, in the order of push().
  /// @param on_drop   Called for each cloud that goes without being handled.
  CloudQueue(ros::CallbackQueueInterface* callback_queue, std::size_t max_size, Callback handle,
             Callback on_drop);
  ~CloudQueue();
  CloudQueue(const CloudQueue&) = delete;
  CloudQueue& operator=(const CloudQueue&) = delete;

  /// Appends a cloud; drops the oldest one when the queue is full.
  void push(const CloudPtr& cloud);

  /// Clouds that wait.
  [[nodiscard]] std::size_t size() const { return clouds_.size(); }

 private:
  class Turn;

  void requestTurn();
  void takeTurn();

  ros::CallbackQueueInterface* callback_queue_;
  std::size_t max_size_;
  Callback handle_;
  Callback on_drop_;
  std::deque<CloudPtr> clouds_;
  bool has_turn_ = false;  ///< A turn waits in the callback queue; only when clouds do, too.
};

}  // namespace cuboid_mapping_ros
