// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/middleware/tf_receiver.h"

#include "cuboid_mapping/ros/middleware/checked_messages.h"
#include "cuboid_mapping/ros/middleware/transforms.h"

#include <ros/console.h>
#include <tf2/exceptions.h>

namespace cuboid_mapping_ros {
namespace {

/// As tf2_ros::TransformListener has it.
constexpr std::uint32_t kTfQueueSize = 100;

}  // namespace

TfReceiver::TfReceiver(ros::NodeHandle nh, tf2::BufferCore& buffer)
    : buffer_(buffer),
      last_time_(ros::Time::now()),
      subscriber_(subscribeGuarded<tf2_msgs::TFMessage>(
          nh, "/tf", {kTfQueueSize, false}, [this](const Event& event) { take(event, false); })),
      static_subscriber_(subscribeGuarded<tf2_msgs::TFMessage>(
          nh, "/tf_static", {kTfQueueSize, false},
          [this](const Event& event) { take(event, true); })) {}

void TfReceiver::take(const Event& event, bool is_static) {
  const ros::Time now = ros::Time::now();
  if (now < last_time_) {
    ROS_WARN("time has jumped back: tf is forgotten");
    buffer_.clear();
  }
  last_time_ = now;
  for (const auto& transform : event.getConstMessage()->transforms) {
    try {
      buffer_.setTransform(tidyTransform(transform), event.getPublisherName(), is_static);
    } catch (const tf2::TransformException& exception) {
      ROS_ERROR_STREAM_THROTTLE(10.0, "a transform of '" << transform.child_frame_id
                                                         << "' is ignored: " << exception.what());
    }
  }
}

}  // namespace cuboid_mapping_ros
