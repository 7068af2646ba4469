// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/middleware/publish.h"
#include "cuboid_mapping/ros/middleware/published_topics.h"

#include "ros/node_probe.h"

#include <std_msgs/Empty.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <future>
#include <string>
#include <vector>

namespace cuboid_mapping_ros::test {
namespace {

/// A std_msgs/Empty that calls a function while it is serialized.
struct Watched {
  std::function<void()> on_serialize;
};

}  // namespace
}  // namespace cuboid_mapping_ros::test

namespace ros {

using cuboid_mapping_ros::test::Watched;

template <>
struct message_traits::MD5Sum<Watched> : message_traits::MD5Sum<std_msgs::Empty> {
  static const char* value(const Watched&) { return MD5Sum<std_msgs::Empty>::value(); }
};
template <>
struct message_traits::DataType<Watched> : message_traits::DataType<std_msgs::Empty> {
  static const char* value(const Watched&) { return DataType<std_msgs::Empty>::value(); }
};
template <>
struct serialization::Serializer<Watched> {
  template <typename StreamT>
  static void write(StreamT& /*stream*/, const Watched& message) {
    message.on_serialize();
  }
  static std::uint32_t serializedLength(const Watched& /*message*/) { return 0; }
};

}  // namespace ros

namespace cuboid_mapping_ros::test {
namespace {

TEST(PublishLarge, HoldsNoLockOfRoscppWhileItSerializes) {
  ros::NodeHandle nh;
  int num_received = 0;
  const boost::function<void(const std_msgs::Empty::ConstPtr&)> count = [&](const auto&) {
    ++num_received;
  };
  const auto subscriber = nh.subscribe("watched", 1, count);
  const auto publisher = nh.advertise<std_msgs::Empty>("watched", 1);
  ASSERT_TRUE(waitFor([&] { return publisher.getNumSubscribers() > 0; }));

  std::future<std::uint32_t> other;
  std::future_status status = std::future_status::deferred;
  publishLarge(publisher, Watched{[&] {
                 other = std::async(std::launch::async,
                                    [&publisher] { return publisher.getNumSubscribers(); });
                 status = other.wait_for(std::chrono::seconds(3));
               }});
  EXPECT_EQ(status, std::future_status::ready) << "another thread waits for roscpp's lock";
  EXPECT_TRUE(waitFor([&] { return num_received == 1; }));
}

TEST(PublishedTopics, HaveTheNamesOfTheirPublishers) {
  ros::NodeHandle nh;
  EXPECT_TRUE(publishersOf("/twice/named").empty());
  const auto publisher = nh.advertise<std_msgs::Empty>("/twice/named", 1);
  EXPECT_EQ(publishersOf("/twice/named"), std::vector<std::string>{ros::this_node::getName()});
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
