// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/node/publishing_thread.h"

#include "cuboid_mapping/ros/middleware/callbacks.h"

#include <utility>

namespace cuboid_mapping_ros {

PublishingThread::PublishingThread(CallbackGuard& guard, std::function<void()> publish)
    : publish_(std::move(publish)), thread_(guard, "publishing") {}

void PublishingThread::start(const ros::NodeHandle& nh, double rate_hz) {
  timer_ = startTimer(withQueue(nh, queue()), 1.0 / rate_hz, publish_);
  thread_.start();
}

void PublishingThread::setRate(double rate_hz) {
  timer_.setPeriod(ros::WallDuration(1.0 / rate_hz), false);
}

void PublishingThread::publishSoon() {
  if (is_due_.exchange(true)) return;
  post(queue(), this, [this] {
    is_due_ = false;
    publish_();
  });
}

}  // namespace cuboid_mapping_ros
