// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/middleware/checked_messages.h"

#include "cuboid_mapping/ros/middleware/names.h"

#include <ros/console.h>

namespace cuboid_mapping_ros {

void CheckedStream::throwOverrun(std::uint32_t count, std::uint32_t num_bytes_left) {
  throw ros::serialization::StreamOverrunException("an array claims " + std::to_string(count) +
                                                   " elements, with " +
                                                   std::to_string(num_bytes_left) + " bytes left");
}

ros::SerializedMessage makeRefusal(const std::string& why) {
  return ros::serialization::serializeServiceResponse(false, why);
}

void logRefusal(const std::string& name, const char* why) noexcept {
  try {
    ROS_ERROR_STREAM_NAMED(kNodeName, name << ": " << why);
  } catch (...) {  // No memory for the line: the caller is told.
  }
}

CallDeadline::CallDeadline(ros::ServiceClient client, std::chrono::milliseconds limit)
    : thread_([client, limit, is_over = is_over_.get_future()]() mutable {
        while (is_over.wait_for(limit) == std::future_status::timeout) {
          try {
            client.shutdown();
          } catch (...) {  // For want of memory: the next one ends the call.
          }
        }
      }) {}

CallDeadline::~CallDeadline() {
  is_over_.set_value();
  thread_.join();
}

}  // namespace cuboid_mapping_ros
