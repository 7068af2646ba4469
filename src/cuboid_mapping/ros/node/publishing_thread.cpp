// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/node/publishing_thread.h"

#include "cuboid_mapping/ros/mapping/cloud_queue.h"

#include <utility>

namespace cuboid_mapping_ros {

PublishingThread::PublishingThread(CallbackGuard& guard, std::function<void()> publish)
    : publish_(std::move(publish)), thread_(guard, "publishing") {}

void PublishingThread::start(const ros::NodeHandle& nh, double rate_hz) {
  period_s_ = 1.0 / rate_hz;
  timer_ = Timer(withQueue(nh, queue()), timerPeriod().toSec(), [this] { publish(); });
  thread_.start();
}

void PublishingThread::setRate(double rate_hz) {
  period_s_ = 1.0 / rate_hz;
  timer_.setPeriod(timerPeriod(), false);
}

void PublishingThread::publishSoon() {
  if (steadySeconds() - last_s_ < period_s_ || is_due_.exchange(true)) return;
  post(queue(), this, [this] {
    is_due_ = false;
    timer_.setPeriod(timerPeriod(), true);
    publish();
  });
}

void PublishingThread::publish() {
  last_s_ = steadySeconds();
  publish_();
}

/// A little longer than the period, so that a cloud which comes a period after the one published before is not just late.
ros::WallDuration PublishingThread::timerPeriod() const {
  return ros::WallDuration(1.1 * period_s_);
}

}  // namespace cuboid_mapping_ros
