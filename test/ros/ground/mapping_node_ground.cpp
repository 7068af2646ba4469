// SPDX-License-Identifier: BSD-3-Clause
// The running node: filter_ground is switched while clouds wait for their turn.
#include "ros/node_probe.h"

#include <dynamic_reconfigure/Reconfigure.h>

#include <atomic>
#include <string>
#include <thread>

namespace cuboid_mapping_ros::test {
namespace {

class NodeGroundTest : public NodeTest {
 protected:
  static bool filterGround(bool is_on) {
    dynamic_reconfigure::Reconfigure change;
    change.request.config.bools.emplace_back();
    change.request.config.bools.back().name = "filter_ground";
    change.request.config.bools.back().value = static_cast<std::uint8_t>(is_on);
    return callService(std::string(kNode) + "/set_parameters", change);
  }
};

TEST_F(NodeGroundTest, EachCloudHasThePosesOfTheFilterThatItMeets) {
  publishStaticTf(makeTransform("map", "base_footprint", makeTranslation(0.0, 0.0, -1.0)));
  std::atomic<bool> goes_on{true};
  std::thread sender([&] {
    for (double stamp_s = 100.0; goes_on; stamp_s += 0.001) {
      publishRoom("map", ros::Time(stamp_s));
      ros::WallDuration(0.0005).sleep();
    }
  });
  for (int i = 0; i < 200; ++i) EXPECT_TRUE(filterGround(i % 2 == 0));
  goes_on = false;
  sender.join();
  EXPECT_TRUE(filterGround(false));
  EXPECT_TRUE(diagnostics_.waitForNextReport());
  EXPECT_TRUE(waitFor([&] { return countNew("clouds waiting") == 0; }));
  EXPECT_GT(countNew("clouds inserted"), 0);
  EXPECT_EQ(countNew("clouds dropped, internal error"), 0);
  EXPECT_EQ(countNew("callbacks failed"), 0);
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
