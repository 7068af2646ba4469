// SPDX-License-Identifier: BSD-3-Clause
// Callbacks that may be lambdas: services, subscriptions and timers, called from the queue of a node handle,
// and functions in a queue.
#pragma once

#include <ros/callback_queue_interface.h>
#include <ros/node_handle.h>

#include <boost/function.hpp>
#include <boost/make_shared.hpp>

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

/// Starts a timer of wall time: simulated time may stand still, or jump back. @param work  ().
template <typename WorkT>
[[nodiscard]] ros::WallTimer startTimer(const ros::NodeHandle& nh, double period_s, WorkT work) {
  return nh.createWallTimer(ros::WallDuration(period_s),
                            [work = std::move(work)](const ros::WallTimerEvent&) { work(); });
}

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
