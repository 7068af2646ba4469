// SPDX-License-Identifier: BSD-3-Clause
// The running node: messages that once made callbacks throw.
#include "ros/node_probe.h"

#include "cuboid_mapping/ros/middleware/callback_guard.h"

#include <stdexcept>
#include <string>
#include <vector>

namespace cuboid_mapping_ros::test {
namespace {

class NodeFaultsTest : public NodeTest {
 protected:
  void SetUp() override {
    publishStaticTf(makeTransform("map", "lidar", makeTranslation(0.05, 0.05, 0.05)));
    NodeTest::SetUp();
  }

  void publishCloud(const std::string& frame_id, double stamp_s) const {
    cloud_publisher_.publish(makeCloud(frame_id, ros::Time(stamp_s), {{1.0, 0.0, 0.0}}));
  }
};

TEST_F(NodeFaultsTest, CloudsOfAllTimesAreInserted) {
  const std::vector<double> stamps{100.0,        2147483646.0, 2147483649.0, 1.0,
                                   4294967294.0, 100.0,        4294967294.9, 101.0};
  long count = 0;
  for (const double stamp : stamps) {
    publishCloud("lidar", stamp);
    ASSERT_TRUE(waitForInserted(++count)) << stamp;
  }
  EXPECT_EQ(countNew("clouds dropped"), 0);
}

TEST_F(NodeFaultsTest, TransformsOfAllTimesEndNothing) {
  const std::vector<double> stamps{4294967294.0, 100.0, 2147483649.0, 1.0, 4294967293.0, 200.0};
  for (const double stamp : stamps) {
    publishTf(makeTransform("map", "strange", makeTranslation(1, 0, 0), ros::Time(stamp)));
    publishCloud("strange", stamp);
  }
  const auto num_received = static_cast<long>(stamps.size());
  ASSERT_TRUE(waitFor([&] { return countNew("clouds received") == num_received; }));
  publishCloud("lidar", 300.0);
  EXPECT_TRUE(waitFor([&] { return countNew("clouds received") == num_received + 1; }));
  const long num_inserted = countNew("clouds inserted");
  publishCloud("lidar", 300.1);
  publishCloud("lidar", 300.2);
  EXPECT_TRUE(waitForInserted(num_inserted + 1));
}

TEST_F(NodeFaultsTest, HandlesWithoutAGuardAreNoticed) {
  ros::NodeHandle plain;
  EXPECT_THROW((void)guardOf(plain), std::logic_error);
  CallbackGuard guard;
  GuardedThread thread(guard, "test");
  EXPECT_EQ(&guardOf(withQueue(plain, thread.queue())), &guard);
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
