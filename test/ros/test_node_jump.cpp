// SPDX-License-Identifier: BSD-3-Clause
// The localization of a running node jumps: ~move_map moves the map, too.
// Needs the features fleet, window.
#include "cuboid_mapping/MoveMap.h"
#include "cuboid_mapping/SetBox.h"
#include "cuboid_mapping/ros/cuboid_map_client.h"
#include "ros/driven_node.h"
#include "support/snapshots.h"

#include <map>
#include <set>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::Cell;
using cuboid_mapping::MoveMap;
using cuboid_mapping::SetBox;
using Voxels = std::map<Cell, float>;

class NodeJump : public DrivenNode {
 protected:
  static MoveMap::Response move(const Eigen::Isometry3d& T_new_old, const ros::Time& stamp,
                                const std::string& node = kName) {
    MoveMap move;
    move.request.transform = tf2::eigenToTransform(T_new_old).transform;
    move.request.stamp = stamp;
    EXPECT_TRUE(ros::service::waitForService(node + "/move_map", ros::Duration(kDeadline_s)));
    EXPECT_TRUE(ros::service::call(node + "/move_map", move));
    return move.response;
  }

  static void lockBox(const Eigen::Vector3d& min, const Eigen::Vector3d& max) {
    SetBox set;
    set.request.occupancy = SetBox::Request::OCCUPIED;
    set.request.lock = 1;
    set.request.boxes.emplace_back();
    set.request.boxes.back().min = tf2::toMsg(min);
    set.request.boxes.back().max = tf2::toMsg(max);
    ASSERT_TRUE(callService(std::string(kName) + "/set_box", set));
    ASSERT_TRUE(set.response.info.success) << set.response.info.message;
  }

  [[nodiscard]] long numBeforeJump() { return figure("clouds dropped, before a jump"); }
};

std::set<Cell> occupiedOf(const Voxels& voxels) {
  std::set<Cell> cells;
  for (const auto& [cell, value] : voxels) {
    if (value >= 0.0F) cells.insert(cell);
  }
  return cells;
}

/// Most of the map is on disk, a client follows it, and a box is locked.
TEST_P(NodeJump, TakesAllOfTheMapAlong) {
  start({"_publish_values:=true", "_window/frame:=base", "_window/size:=8.0",
         "_window/file:=" + (folder_ / "map.sqlite")});
  const CuboidMapClient client(nh_, kName);
  drive(0.0, 20.0);
  EXPECT_GT(figure("window parts on disk only"), 0);
  lockBox({19.0, 0.0, 0.0}, {19.2, 0.2, 0.2});
  const Voxels before = saveMap();
  ASSERT_GT(before.size(), 20000U);

  T_map_start_ = Eigen::AngleAxisd(M_PI / 2.0, Eigen::Vector3d::UnitZ());
  T_map_start_.pretranslate(Eigen::Vector3d(3.0, -2.0, 0.5));
  const ros::Time jump(time_s_ + 0.05);
  const MoveMap::Response answer = move(T_map_start_, jump);
  ASSERT_TRUE(answer.info.success) << answer.info.message;
  EXPECT_GT(answer.cuboids, 100U);
  Voxels expected;
  for (const auto& [cell, value] : before) {
    expected[{29 - cell.y, cell.x - 20, cell.z + 5}] = value;
  }
  EXPECT_EQ(saveMap(), expected);
  EXPECT_TRUE(waitFor([&] {
    return client.read([&](const cuboid_mapping::CuboidMap& map) {
      return cuboid_mapping::test::voxelsOf(map) == expected;
    });
  })) << "who follows the map has it in the new frame";

  publishRoom(ros::Time(time_s_));  // A late cloud, in the old frame.
  EXPECT_TRUE(waitFor([this] { return numBeforeJump() == 1; }));
  EXPECT_EQ(saveMap(), expected);

  drive(20.0, 0.0);
  const Voxels after = saveMap();
  EXPECT_EQ(after.size(), expected.size()) << "the same places, seen in the new frame";
  EXPECT_EQ(occupiedOf(after), occupiedOf(expected)) << "the locked box among them";
  EXPECT_EQ(figure("window failures"), 0);
}

TEST_P(NodeJump, ACloudThatWaitsIsOfTheFrameAsItWas) {
  start({});
  drive(0.0, 1.0);
  const Voxels before = saveMap();
  const ros::Time waiting(time_s_ + 0.1);
  publishRoom(waiting);
  EXPECT_TRUE(waitFor([this] { return figure("clouds waiting") == 1; }));
  T_map_start_ = makeTranslation(0.0, 0.0, 0.3);
  ASSERT_TRUE(move(T_map_start_, waiting + ros::Duration(0.1)).info.success);
  publishPose(1.0, waiting);
  EXPECT_TRUE(waitFor([this] { return numBeforeJump() == 1; }));
  EXPECT_EQ(figure("clouds waiting"), 0);
  Voxels expected;
  for (const auto& [cell, value] : before) expected[cell + Cell{0, 0, 3}] = value;
  EXPECT_EQ(saveMap(), expected);
  std_srvs::Empty empty;
  ASSERT_TRUE(callService(std::string(kName) + "/reset", empty));
  drive(0.0, 1.0);  // Its first clouds are as old.
}

TEST_P(NodeJump, IsRefusedWhereTheMapCannotBeTakenAlongExactly) {
  start({});
  drive(0.0, 1.0);
  const Voxels before = saveMap();
  const auto shifted = move(makeTranslation(0.32, 0.0, 0.0), ros::Time(time_s_ + 1.0));
  EXPECT_FALSE(shifted.info.success);
  EXPECT_NE(shifted.info.message.find("(0.3, 0, 0)"), std::string::npos) << shifted.info.message;
  const auto late = move(makeTranslation(0.3, 0.0, 0.0), ros::Time(time_s_));
  EXPECT_FALSE(late.info.success);
  EXPECT_NE(late.info.message.find("~pause"), std::string::npos) << late.info.message;
  const auto far_ahead = move(makeTranslation(0.3, 0.0, 0.0), ros::Time(4e9));
  EXPECT_FALSE(far_ahead.info.success) << "all clouds until then would be dropped";
  EXPECT_EQ(saveMap(), before);
  drive(1.0, 2.0);
  EXPECT_EQ(numBeforeJump(), 0);
}

TEST_P(NodeJump, IsRefusedByANodeThatMergesWhatRobotsSay) {
  if (GetParam()) GTEST_SKIP() << "the same for the nodelet";
  cuboid_mapping::test::Program merger(
      {CUBOID_MAPPING_NODE, "__name:=merger", "__log:=/dev/null", "_merge/robots:=/nobody"});
  const auto answer = move(makeTranslation(1.0, 0.0, 0.0), ros::Time(), "/merger");
  EXPECT_FALSE(answer.info.success);
  EXPECT_NE(answer.info.message.find("map_merge"), std::string::npos) << answer.info.message;
  merger.send(SIGINT);
  EXPECT_EQ(merger.finish().status, 0);
}

INSTANTIATE_TEST_SUITE_P(AsNodeAndNodelet, NodeJump, ::testing::Bool());

}  // namespace
}  // namespace cuboid_mapping_ros::test
