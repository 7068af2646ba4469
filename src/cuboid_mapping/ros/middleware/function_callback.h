// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/callback_queue_interface.h>

#include <boost/make_shared.hpp>

#include <cstdint>
#include <functional>
#include <utility>

namespace cuboid_mapping_ros {

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

/// Removes the functions that an owner has posted; returns when none of them runs any more.
inline void removePosted(ros::CallbackQueueInterface& queue, const void* owner) {
  queue.removeByID(reinterpret_cast<std::uintptr_t>(owner));
}

}  // namespace cuboid_mapping_ros
