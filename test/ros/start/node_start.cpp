// SPDX-License-Identifier: BSD-3-Clause
// A running node with start_free: the first cloud of each map makes the robot's place free.
#include "ros/driven_node.h"

#include <std_srvs/Empty.h>

namespace cuboid_mapping_ros::test {
namespace {

class NodeStart : public DrivenNode {
 protected:
  /// Whether a voxel outside the room, in the box of the robot, is known.
  [[nodiscard]] bool hasStartBox() const { return saveMap().count({17, 0, 0}) > 0; }
};

TEST_P(NodeStart, FreesTheRobotsPlaceAgainAfterAReset) {
  start({"_base_frame_id:=base", "_start_free:=1.5 -0.3 -0.3 2.0 0.3 0.3"});
  drive(0.0, 0.0);
  EXPECT_TRUE(hasStartBox());
  std_srvs::Empty empty;
  ASSERT_TRUE(callService(std::string(kName) + "/reset", empty));
  EXPECT_FALSE(hasStartBox());
  drive(0.0, 0.0);
  EXPECT_TRUE(hasStartBox());
}

INSTANTIATE_TEST_SUITE_P(NodeAndNodelet, NodeStart, ::testing::Bool());

}  // namespace
}  // namespace cuboid_mapping_ros::test
