// SPDX-License-Identifier: BSD-3-Clause
// Callbacks that may be lambdas: services, subscriptions and timers, called from the queue of a node handle,
// and functions in a queue.
#pragma once

#include <ros/callback_queue_interface.h>
#include <ros/node_handle.h>
#include <ros/wall_timer.h>
#include <ros/wall_timer_options.h>

#include <boost/function.hpp>
#include <boost/make_shared.hpp>
#include <boost/shared_ptr.hpp>
#include <boost/weak_ptr.hpp>

#include <cstdint>
#include <functional>
#include <string>
#include <utility>

namespace cuboid_mapping_ros {

/// Offers a service. @param answer  (const Request&, Response&). The caller gets the text of its exceptions.
template <typename ServiceT, typename AnswerT>
[[nodiscard]] ros::ServiceServer offerService(ros::NodeHandle nh, const std::string& name,
                                              AnswerT answer) {
  using Request = typename ServiceT::Request;
  using Response = typename ServiceT::Response;
  return nh.advertiseService<Request, Response>(
      name, [answer = std::move(answer)](Request& request, Response& response) {
        answer(request, response);
        return true;
      });
}

/// Subscribes to a topic. @param take  (const MessageT::ConstPtr&).
template <typename MessageT, typename TakeT>
[[nodiscard]] ros::Subscriber subscribeTo(ros::NodeHandle nh, const std::string& topic,
                                          std::uint32_t queue_size, TakeT take) {
  const boost::function<void(const typename MessageT::ConstPtr&)> callback = std::move(take);
  return nh.subscribe(topic, queue_size, callback);
}

/// A timer of wall time: simulated time may stand still, or jump back. Its end waits for a call that runs, which roscpp
/// 1.15 does not: so it must not end in such a call, nor under a lock that the call takes.
class Timer {
 public:
  Timer() = default;
  /// Starts it. @param work  ().
  template <typename WorkT>
  Timer(const ros::NodeHandle& nh, double period_s, WorkT work) {
    ros::WallTimerOptions options;
    options.period = ros::WallDuration(period_s);
    options.callback = [work = std::move(work)](const ros::WallTimerEvent&) { work(); };
    options.tracked_object = used_;  // Held by each call.
    timer_ = nh.createWallTimer(options);
  }
  Timer(Timer&&) = default;
  /// @pre This one has not been started.
  Timer& operator=(Timer&&) = default;
  ~Timer() {
    if (!used_) return;  // Another one has taken it over.
    timer_.stop();
    const boost::weak_ptr<const void> used = std::exchange(used_, nullptr);
    while (!used.expired()) ros::WallDuration(0.001).sleep();
  }

  void setPeriod(const ros::WallDuration& period, bool is_reset) {
    timer_.setPeriod(period, is_reset);
  }

 private:
  boost::shared_ptr<const void> used_ = boost::make_shared<char>();
  ros::WallTimer timer_;
};

/// A function in a callback queue.
class FunctionCallback : public ros::CallbackInterface {
 public:
  explicit FunctionCallback(std::function<void()> function) : function_(std::move(function)) {}

  CallResult call() override {
    function_();
    return Success;
  }

 private:
  std::function<void()> function_;
};

/// Makes a queue call a function, once. Thread-safe. @param owner  For removePosted().
inline void post(ros::CallbackQueueInterface& queue, const void* owner,
                 std::function<void()> function) {
  queue.addCallback(boost::make_shared<FunctionCallback>(std::move(function)),
                    reinterpret_cast<std::uintptr_t>(owner));
}

/// Removes the functions that an owner has posted. One that runs may go on: roscpp 1.15 does not wait for it.
inline void removePosted(ros::CallbackQueueInterface& queue, const void* owner) {
  queue.removeByID(reinterpret_cast<std::uintptr_t>(owner));
}

}  // namespace cuboid_mapping_ros
