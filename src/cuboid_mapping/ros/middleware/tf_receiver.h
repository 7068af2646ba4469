// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/message_event.h>
#include <ros/node_handle.h>
#include <ros/subscriber.h>
#include <ros/time.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

namespace cuboid_mapping_ros {

/// Fills a buffer from /tf and /tf_static. Empties it when the node's time jumps back by more than kMinJump_s:
/// tf2_ros::TransformListener empties it at any step back, as of two /clock messages that overtake each other.
/// Thread rule: works in the queue of the node handle, which must have one thread.
class TfReceiver {
 public:
  static constexpr double kMinJump_s = 1.0;

  /// @param buffer  Must outlive this object.
  TfReceiver(ros::NodeHandle nh, tf2::BufferCore& buffer);
  TfReceiver(const TfReceiver&) = delete;
  TfReceiver& operator=(const TfReceiver&) = delete;

 private:
  using Event = ros::MessageEvent<const tf2_msgs::TFMessage>;

  void take(const Event& event, bool is_static);

  tf2::BufferCore& buffer_;
  ros::Time latest_;  ///< The node's time so far.
  ros::Subscriber subscriber_;
  ros::Subscriber static_subscriber_;
};

}  // namespace cuboid_mapping_ros
