// SPDX-License-Identifier: BSD-3-Clause
// The running node with simulated time, as with a bag played in a loop with its clock.
#include "ros/node_probe.h"

#include <rosgraph_msgs/Clock.h>

#include <vector>

namespace cuboid_mapping_ros::test {
namespace {

class NodeClockTest : public ::testing::Test {
 protected:
  void SetUp() override {
    clock_publisher_ = nh_.advertise<rosgraph_msgs::Clock>("/clock", 100);
    cloud_publisher_ = nh_.advertise<sensor_msgs::PointCloud2>("/cloud_in", 100);
    ASSERT_TRUE(waitFor([this] {
      return clock_publisher_.getNumSubscribers() > 0 && cloud_publisher_.getNumSubscribers() > 0;
    }));
  }

  void setClock(double now_s) {
    rosgraph_msgs::Clock clock;
    clock.clock = ros::Time(now_s);
    // Again and again, as a player does: the only listener so far may be this program, which has simulated time, too.
    // The node's diagnostics have its time.
    ASSERT_TRUE(waitFor([&] {
      clock_publisher_.publish(clock);
      return diagnostics_.status().stamp == clock.clock;
    }));
  }

  void publishTf(double stamp_s) {
    broadcaster_.sendTransform(
        makeTransform("map", "lidar", Eigen::Isometry3d::Identity(), ros::Time(stamp_s)));
  }

  void publishCloud(double stamp_s) {
    cloud_publisher_.publish(makeCloud("lidar", ros::Time(stamp_s), {{1.0, 0.0, 0.0}}));
  }

  bool waitForNumber(const std::string& key, long count) {
    return waitFor([&] { return diagnostics_.status().number(key) == count; });
  }

  ros::NodeHandle nh_;
  ros::Publisher clock_publisher_;
  ros::Publisher cloud_publisher_;
  tf2_ros::TransformBroadcaster broadcaster_;
  DiagnosticsProbe diagnostics_;
};

TEST_F(NodeClockTest, EveryRoundOfALoopIsMapped) {
  long num_inserted = 0;
  for (const double length_s : {30.0, 3.0}) {  // longer and shorter than the memory of tf
    for (int round = 0; round < 3; ++round) {
      for (double t = 0.0; t <= 1.0; t += 0.25) {
        const double now_s = 1000.0 + t * length_s;
        setClock(now_s);
        // tf arrives before or after the cloud, which needs the later transform: once the cloud is in the map,
        // no transform remains that could arrive after a jump.
        const auto publish_tf = [&] {
          publishTf(now_s - 0.1);
          publishTf(now_s + 0.1);
        };
        if (round == 1) publish_tf();
        publishCloud(now_s);
        ASSERT_TRUE(waitForNumber("clouds received", num_inserted + 1));
        if (round != 1) publish_tf();
        ASSERT_TRUE(waitForNumber("clouds inserted", ++num_inserted))
            << "round " << round << ", at " << now_s << " s: " << diagnostics_.status().message;
      }
    }
  }
  EXPECT_EQ(diagnostics_.status().number("clouds dropped"), 0);
}

TEST_F(NodeClockTest, MessagesMayOvertakeTheClockWhenALoopBeginsAgain) {
  constexpr double kEnd_s = 9000.0;  // The round is longer than the memory of tf.
  setClock(kEnd_s);
  long num_inserted = diagnostics_.status().number("clouds inserted");
  const long num_dropped = diagnostics_.status().number("clouds dropped");
  for (int round = 0; round < 2; ++round) {
    setClock(kEnd_s);
    publishTf(kEnd_s - 0.1);
    publishTf(kEnd_s + 0.1);
    publishCloud(kEnd_s);
    ASSERT_TRUE(waitForNumber("clouds inserted", ++num_inserted)) << diagnostics_.status().message;
    if (round == 0) publishCloud(1000.0);  // Of the next round.
    setClock(1000.0);
    publishTf(kEnd_s + 0.2);  // Of this one.
    publishTf(999.9);
    publishTf(1000.1);
    if (round == 1) publishCloud(1000.0);
    ASSERT_TRUE(waitForNumber("clouds inserted", ++num_inserted)) << diagnostics_.status().message;
  }
  EXPECT_EQ(diagnostics_.status().number("clouds dropped"), num_dropped);
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
