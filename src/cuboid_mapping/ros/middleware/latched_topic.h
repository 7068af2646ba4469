// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/middleware/publish.h"

#include <ros/advertise_options.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/single_subscriber_publisher.h>

#include <boost/function.hpp>

#include <cstdint>
#include <string>

namespace cuboid_mapping_ros {

/// A topic that ROS latches: a subscriber keeps the last message for others in its process, and recorders mark
/// the topic as latched. A new connection gets the messages that `on_connect` sends.
///
/// roscpp would send a new connection the last message of its publisher. That is outdated after a time without
/// subscribers, when nothing is built. Therefore the latching publisher never publishes; a second publisher of
/// the topic does.
template <typename MessageT>
class LatchedTopic {
 public:
  using Callback = boost::function<void(const ros::SingleSubscriberPublisher&)>;

  /// @param on_connect, on_disconnect  Called from the queue of the node handle. on_disconnect may be empty.
  LatchedTopic(ros::NodeHandle nh, const std::string& name, std::uint32_t queue_size,
               const Callback& on_connect, const Callback& on_disconnect = {})
      : latch_(nh.advertise<MessageT>(name, queue_size, /*latch=*/true)),
        publisher_(nh.advertise<MessageT>(name, queue_size, on_connect, on_disconnect)) {}

  void publish(const MessageT& message) const { publishLarge(publisher_, message); }
  [[nodiscard]] bool hasListeners() const { return publisher_.getNumSubscribers() > 0; }
  [[nodiscard]] std::string name() const { return publisher_.getTopic(); }

 private:
  ros::Publisher latch_;
  ros::Publisher publisher_;
};

}  // namespace cuboid_mapping_ros
