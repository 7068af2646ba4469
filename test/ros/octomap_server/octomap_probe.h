// SPDX-License-Identifier: BSD-3-Clause
// Common parts of the tests of octomap_server's interface: topics and octrees of a running node.
#pragma once

#include "cuboid_mapping/io/octree_stream.h"
#include "ros/node_probe.h"

#include <octomap_msgs/BoundingBoxQuery.h>
#include <octomap_msgs/GetOctomap.h>

#include <string>

namespace cuboid_mapping_ros::test {

/// Keeps the first and the last message of a topic.
template <typename MessageT>
class TopicProbe {
 public:
  explicit TopicProbe(const std::string& topic) {
    const boost::function<void(const boost::shared_ptr<const MessageT>&)> callback =
        [this](const boost::shared_ptr<const MessageT>& message) {
          if (count_ == 0) first_ = *message;
          last_ = *message;
          ++count_;
        };
    subscriber_ = nh_.subscribe(topic, 10, callback);
  }
  /// Waits until the publisher knows this subscriber.
  bool waitForConnection() {
    return waitFor([this] { return subscriber_.getNumPublishers() > 0; });
  }
  /// Waits for a message that fulfils the condition.
  bool waitForMessage(const std::function<bool(const MessageT&)>& condition) {
    return waitFor([&] { return count_ > 0 && condition(last_); });
  }
  [[nodiscard]] const MessageT& first() const { return first_; }
  [[nodiscard]] const MessageT& last() const { return last_; }
  [[nodiscard]] int count() const { return count_; }

 private:
  ros::NodeHandle nh_;
  MessageT first_;
  MessageT last_;
  int count_ = 0;
  ros::Subscriber subscriber_;
};

inline std::string bytesOf(const octomap_msgs::Octomap& message) {
  return {message.data.begin(), message.data.end()};
}

/// The leaves of a message of either kind.
inline cuboid_mapping::OctreeContent contentOf(const octomap_msgs::Octomap& message) {
  return message.binary != 0 ? cuboid_mapping::readBinaryOctree(bytesOf(message), -1.0F, 1.0F)
                             : cuboid_mapping::readFullOctree(bytesOf(message));
}

inline double countVoxels(const cuboid_mapping::OctreeContent& content, bool is_occupied) {
  double count = 0.0;
  for (const auto& leaf : content.leaves) {
    if ((leaf.log_odds >= 0.0F) == is_occupied) count += leaf.box.numVoxels();
  }
  return count;
}

inline octomap_msgs::Octomap callOctomap(const std::string& service) {
  octomap_msgs::GetOctomap get;
  EXPECT_TRUE(ros::service::waitForService(service, ros::Duration(kDeadline_s)));
  EXPECT_TRUE(callService(service, get));
  return get.response.map;
}

}  // namespace cuboid_mapping_ros::test
