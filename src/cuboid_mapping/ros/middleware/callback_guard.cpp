// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/middleware/callback_guard.h"

#include <ros/console.h>

#include <boost/make_shared.hpp>

#include <stdexcept>
#include <utility>

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
    bool is_ready = true;  // One that fails is called, and fails there.
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
  note(failures_, "a callback failed; the node keeps running", name, what);
}

void CallbackGuard::noteRefused(const std::string& name, const char* what) noexcept {
  note(refused_, "a damaged message was refused", name, what);
}

void CallbackGuard::note(Tally& tally, const char* kind, const std::string& name,
                         const char* what) noexcept {
  try {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++tally.count;
    const std::string text = name + ": " + what;
    const ros::WallTime now = ros::WallTime::now();
    // Others send as many damaged messages as they like, each with words of its own.
    const bool is_same = text == tally.last || &tally == &refused_;
    const bool is_repeated = is_same && now - tally.logged < ros::WallDuration(kLogPeriod_s);
    tally.last = text;
    if (is_repeated) return;
    tally.logged = now;
    ROS_ERROR_STREAM(kind << ": " << text << " (" << tally.count << " so far)");
  } catch (...) {
    // There is no memory for words; it is counted.
  }
}

std::uint64_t CallbackGuard::numFailures() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return failures_.count;
}

std::string CallbackGuard::lastFailure() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return failures_.last;
}

std::uint64_t CallbackGuard::numRefused() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return refused_.count;
}

std::string CallbackGuard::lastRefused() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return refused_.last;
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
