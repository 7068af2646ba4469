// SPDX-License-Identifier: BSD-3-Clause
// The log of running nodes.
#pragma once

#include "ros/node_probe.h"

#include <rosgraph_msgs/Log.h>

#include <algorithm>
#include <string>
#include <vector>

namespace cuboid_mapping_ros::test {

/// Lines of the log of all nodes, from when they know this subscriber: the first may be missed.
class LogProbe {
 public:
  LogProbe() {
    const boost::function<void(const rosgraph_msgs::Log::ConstPtr&)> callback =
        [this](const rosgraph_msgs::Log::ConstPtr& log) { lines_.push_back(*log); };
    subscriber_ = nh_.subscribe("/rosout", 1000, callback);
  }

  /// @param node  Node whose lines count; empty: all nodes.
  [[nodiscard]] bool has(const std::string& part, const std::string& node = "") const {
    return std::any_of(lines_.begin(), lines_.end(), [&](const rosgraph_msgs::Log& line) {
      return (node.empty() || line.name == node) && line.msg.find(part) != std::string::npos;
    });
  }

  bool waitForLine(const std::string& part, const std::string& node = "") {
    return waitFor([&] { return has(part, node); });
  }

 private:
  ros::NodeHandle nh_;
  std::vector<rosgraph_msgs::Log> lines_;
  ros::Subscriber subscriber_;
};

}  // namespace cuboid_mapping_ros::test
