// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/message_event.h>
#include <ros/node_handle.h>
#include <ros/subscriber.h>
#include <ros/time.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

namespace cuboid_mapping_ros {

/// Fills a buffer from /tf and /tf_static. Clears it when the node's time, or all of tf, jumps back by more
/// than kMinJump_s; the latter if a recording is played again without its clock. tf2_ros::TransformListener
/// clears it at any step back of the clock, even if two /clock messages overtake each other, and never without
/// a clock.
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
  /// Whether all of the last messages were older than the transforms that tf keeps.
  [[nodiscard]] bool hasBegunAnew(const tf2_msgs::TFMessage& message);

  tf2::BufferCore& buffer_;
  ros::Time latest_;       ///< Latest time of the node.
  double newest_s_ = 0.0;  ///< Newest stamp of a transform.
  int num_old_ = 0;        ///< Number of old messages in a row.
  ros::Subscriber subscriber_;
  ros::Subscriber static_subscriber_;
};

}  // namespace cuboid_mapping_ros
