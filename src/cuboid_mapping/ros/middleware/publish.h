// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/publisher.h>
#include <ros/serialization.h>
#include <ros/time.h>
#include <ros/topic_manager.h>

namespace cuboid_mapping_ros {

/// Publishes a large message. Publisher::publish() would serialize it under a lock that roscpp's one thread for all
/// connections takes each time round: until then no service call is read, and no answer of another node.
/// @pre The publisher does not latch: the message would not be kept.
template <typename MessageT>
void publishLarge(const ros::Publisher& publisher, const MessageT& message) {
  ros::SerializedMessage bytes = ros::serialization::serializeMessage(message);
  ros::TopicManager::instance()->publish(
      publisher.getTopic(), [bytes] { return bytes; }, bytes);
}

/// When a picture of the whole map may be made again, of which the last one took from `start` to `end`: at most a
/// twentieth of the time goes into it. Most of a large picture has not changed, and each subscriber pays for it, too.
inline ros::SteadyTime endOfRest(const ros::SteadyTime& start, const ros::SteadyTime& end) {
  constexpr double kShareOfTime = 0.05;
  return end + (end - start) * (1.0 / kShareOfTime);
}

}  // namespace cuboid_mapping_ros
