// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/callback_queue_interface.h>

#include <cstdint>

namespace cuboid_mapping_ros {

/// Calls back at once, in the thread that has something to call back for: roscpp's network thread, or a
/// publisher of the same process. For callbacks that take some microseconds, and may run side by side.
class DirectQueue : public ros::CallbackQueueInterface {
 public:
  void addCallback(const ros::CallbackInterfacePtr& callback,
                   std::uint64_t /*removal_id*/ = 0) override {
    callback->call();
  }
  void removeByID(std::uint64_t /*removal_id*/) override {}
};

}  // namespace cuboid_mapping_ros
