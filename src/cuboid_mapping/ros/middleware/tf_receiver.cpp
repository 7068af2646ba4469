// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/middleware/tf_receiver.h"

#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"

#include <ros/console.h>
#include <tf2/exceptions.h>

#include <algorithm>

namespace cuboid_mapping_ros {
namespace {

/// Queue size of tf2_ros::TransformListener.
constexpr std::uint32_t kTfQueueSize = 100;
/// Maximum number of old messages in a row: more do not come from one sender whose clock is wrong.
constexpr int kMaxOld = 10;

}  // namespace

TfReceiver::TfReceiver(ros::NodeHandle nh, tf2::BufferCore& buffer)
    : buffer_(buffer), latest_(ros::Time::now()) {
  using Take = boost::function<void(const Event&)>;
  subscriber_ = nh.subscribe<tf2_msgs::TFMessage>(
      "/tf", kTfQueueSize, Take([this](const Event& event) { take(event, false); }));
  static_subscriber_ = nh.subscribe<tf2_msgs::TFMessage>(
      "/tf_static", kTfQueueSize, Take([this](const Event& event) { take(event, true); }));
}

void TfReceiver::take(const Event& event, bool is_static) {
  const ros::Time now = ros::Time::now();
  if (!is_static && hasBegunAnew(*event.getConstMessage())) {
    ROS_WARN_NAMED(kNodeName, "all transforms are older than before: the tf buffer is cleared");
    buffer_.clear();
  }
  if (now.toSec() < latest_.toSec() - kMinJump_s) {
    ROS_WARN_NAMED(kNodeName, "time has jumped back by %.1f s: the tf buffer is cleared",
                   latest_.toSec() - now.toSec());
    buffer_.clear();
    latest_ = now;
    newest_s_ = 0.0;
  }
  latest_ = std::max(latest_, now);
  for (const auto& transform : event.getConstMessage()->transforms) {
    try {
      buffer_.setTransform(tidyTransform(transform), event.getPublisherName(), is_static);
    } catch (const tf2::TransformException& exception) {
      ROS_ERROR_STREAM_THROTTLE(10.0, "a transform of '" << transform.child_frame_id
                                                         << "' is ignored: " << exception.what());
    }
  }
}

bool TfReceiver::hasBegunAnew(const tf2_msgs::TFMessage& message) {
  double newest_s = 0.0;
  for (const auto& transform : message.transforms) {
    newest_s = std::max(newest_s, transform.header.stamp.toSec());
  }
  const bool is_old = newest_s < newest_s_ - buffer_.getCacheLength().toSec();
  num_old_ = is_old ? num_old_ + 1 : 0;
  const bool is_anew = num_old_ > kMaxOld;
  if (is_anew) num_old_ = 0;
  newest_s_ = is_anew ? newest_s : std::max(newest_s_, newest_s);
  return is_anew;
}

}  // namespace cuboid_mapping_ros
