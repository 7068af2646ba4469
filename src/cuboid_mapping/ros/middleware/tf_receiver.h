// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/message_event.h>
#include <ros/node_handle.h>
#include <ros/subscriber.h>
#include <ros/time.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

namespace cuboid_mapping_ros {

/// Fills a buffer from /tf and /tf_static. Empties it when the node's time jumps back by more than kMinJump_s, or all of tf
/// does, as a recording that is played again without its clock. tf2_ros::TransformListener empties it at any step back
/// of the clock, as of two /clock messages that overtake each other, and without a clock never.
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
  /// Whether the last messages were all older than what tf keeps.
  [[nodiscard]] bool hasBegunAnew(const tf2_msgs::TFMessage& message);

  tf2::BufferCore& buffer_;
  ros::Time latest_;       ///< The node's time so far.
  double newest_s_ = 0.0;  ///< Stamp of a transform.
  int num_old_ = 0;        ///< Messages since one that was not old.
  ros::Subscriber subscriber_;
  ros::Subscriber static_subscriber_;
};

}  // namespace cuboid_mapping_ros
