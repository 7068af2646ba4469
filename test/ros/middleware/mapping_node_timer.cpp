// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/middleware/callback_guard.h"
#include "cuboid_mapping/ros/middleware/callbacks.h"
#include "ros/node_probe.h"

#include <atomic>
#include <optional>

namespace cuboid_mapping_ros::test {
namespace {

TEST(Timer, EndsAfterACallThatRuns) {
  CallbackGuard guard;
  GuardedThread thread(guard, "timer");
  std::atomic<bool> has_begun{false};
  std::atomic<bool> has_ended{false};
  std::optional timer(Timer(withQueue(ros::NodeHandle("timer"), thread.queue()), 0.01, [&] {
    has_begun = true;
    ros::WallDuration(0.3).sleep();
    has_ended = true;
  }));
  thread.start();
  ASSERT_TRUE(waitFor([&] { return has_begun.load(); }));
  timer.reset();
  EXPECT_TRUE(has_ended);
  has_begun = false;
  ros::WallDuration(0.1).sleep();
  EXPECT_FALSE(has_begun);
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
