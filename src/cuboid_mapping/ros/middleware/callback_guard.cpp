// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/middleware/callback_guard.h"

#include <ros/console.h>

#include <boost/make_shared.hpp>

#include <stdexcept>

namespace cuboid_mapping_ros {
namespace {

constexpr double kLogPeriod_s = 10.0;

class GuardedCallback : public ros::CallbackInterface {
 public:
  GuardedCallback(ros::CallbackInterfacePtr callback, CallbackGuard& guard, const std::string& name)
      : callback_(std::move(callback)), guard_(guard), name_(name) {}

  CallResult call() override {
    CallResult result = Invalid;
    guard_.run(name_, [&] { result = callback_->call(); });
    return result;
  }

  bool ready() override {
    bool is_ready = true;  // A callback that fails here is called, and fails there.
    guard_.run(name_, [&] { is_ready = callback_->ready(); });
    return is_ready;
  }

 private:
  ros::CallbackInterfacePtr callback_;
  CallbackGuard& guard_;
  const std::string& name_;
};

}  // namespace

void CallbackGuard::noteFailure(const std::string& name, const char* what) noexcept {
  try {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++num_failures_;
    const std::string text = name + ": " + what;
    const ros::SteadyTime now = ros::SteadyTime::now();
    const bool is_repeated =
        text == last_failure_ && now - last_logged_ < ros::WallDuration(kLogPeriod_s);
    last_failure_ = text;
    if (is_repeated) return;
    last_logged_ = now;
    ROS_ERROR_STREAM("a callback failed; the node keeps running: " << text << " (" << num_failures_
                                                                   << " so far)");
  } catch (...) {
    // There is no memory for the text; the failure is counted.
  }
}

std::uint64_t CallbackGuard::numFailures() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return num_failures_;
}

std::string CallbackGuard::lastFailure() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return last_failure_;
}

GuardedQueue::GuardedQueue(ros::CallbackQueueInterface& queue, CallbackGuard& guard,
                           std::string name)
    : queue_(queue), guard_(guard), name_(std::move(name)) {}

void GuardedQueue::addCallback(const ros::CallbackInterfacePtr& callback,
                               std::uint64_t removal_id) {
  queue_.addCallback(boost::make_shared<GuardedCallback>(callback, guard_, name_), removal_id);
}

void GuardedQueue::removeByID(std::uint64_t removal_id) { queue_.removeByID(removal_id); }

ros::NodeHandle withQueue(const ros::NodeHandle& nh, GuardedQueue& queue) {
  ros::NodeHandle result(nh);
  result.setCallbackQueue(&queue);
  return result;
}

CallbackGuard& guardOf(const ros::NodeHandle& nh) {
  auto* const queue = dynamic_cast<GuardedQueue*>(nh.getCallbackQueue());
  if (queue == nullptr) throw std::logic_error("a node handle without GuardedQueue: see withQueue");
  return queue->guard();
}

}  // namespace cuboid_mapping_ros
