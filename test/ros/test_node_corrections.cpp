// SPDX-License-Identifier: BSD-3-Clause
// A running node whose robot drifts: ~correct_poses and corrected_path make the map that the right poses make.
#include "cuboid_mapping/CorrectPoses.h"
#include "cuboid_mapping/CorrectPosesAction.h"
#include "cuboid_mapping/MoveMap.h"
#include "cuboid_mapping/SetBox.h"
#include "ros/driven_node.h"

#include <actionlib/client/simple_action_client.h>
#include <nav_msgs/Path.h>

#include <map>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::Cell;
using cuboid_mapping::CorrectPoses;
using cuboid_mapping::SetBox;
using Voxels = std::map<Cell, float>;

constexpr int kNumClouds = 30;

/// Where the robot is at a cloud: it drives along a bow.
Eigen::Isometry3d truth(int i) {
  return Eigen::Translation3d(0.3 * i, 0.01 * i * i, 0.0) *
         Eigen::AngleAxisd(0.05 * i, Eigen::Vector3d::UnitZ());
}

/// Where its odometry takes it to be.
Eigen::Isometry3d drifted(int i) {
  return truth(i) * Eigen::Translation3d(0.02 * i, -0.013 * i, 0.004 * i) *
         Eigen::AngleAxisd(0.004 * i, Eigen::Vector3d(0.1, 0.2, 1.0).normalized());
}

ros::Time stampOf(int i) { return ros::Time(100.0 + 0.1 * i); }

nav_msgs::Path pathOf(int begin, int end) {
  nav_msgs::Path path;
  path.header.frame_id = "map";
  for (int i = begin; i < end; ++i) {
    path.poses.emplace_back();
    path.poses.back().header.stamp = stampOf(i);
    path.poses.back().pose = tf2::toMsg(truth(i));
  }
  return path;
}

class NodeCorrections : public DrivenNode {
 protected:
  using Pose = Eigen::Isometry3d (*)(int);

  void startKeeping(const std::vector<std::string>& others = {}) {
    std::vector<std::string> parameters{"_keep_clouds/memory:=50", "_keep_clouds/body_frame:=base"};
    parameters.insert(parameters.end(), others.begin(), others.end());
    start(parameters);
  }

  void send(int i, Pose pose) {
    tf2_msgs::TFMessage tf;
    // The lidar is mounted askew.
    tf.transforms.push_back(makeTransform("map", "base", pose(i), stampOf(i)));
    tf.transforms.push_back(
        makeTransform("base", "lidar", makeTranslation(0.2, 0.1, 0.3), stampOf(i)));
    tf_.publish(tf);
    clouds_.publish(makeCloud("lidar", stampOf(i), makeRoom({1.0, 1.0, 0.5})));
    ++num_sent_;
  }

  void sendAll(int begin, int end, Pose pose) {
    for (int i = begin; i < end; ++i) send(i, pose);
    ASSERT_TRUE(waitFor([this] {
      return diagnostics_.status().number("clouds inserted") == num_sent_;
    })) << diagnostics_.status().message;
  }

  /// Clouds, with an edit and a locked box in between.
  void driveAll(Pose pose) {
    sendAll(0, 10, pose);
    setBox(SetBox::Request::OCCUPIED, 1, {1.0, 0.5, 0.0}, {1.4, 0.9, 0.4});
    sendAll(10, 20, pose);
    setBox(SetBox::Request::UNKNOWN, 0, {2.0, 0.0, -1.0}, {3.0, 3.0, 1.0});
    sendAll(20, kNumClouds, pose);
  }

  static void setBox(std::uint8_t occupancy, bool lock, const Eigen::Vector3d& min,
                     const Eigen::Vector3d& max) {
    SetBox set;
    set.request.occupancy = occupancy;
    set.request.lock = static_cast<std::uint8_t>(lock);
    set.request.boxes.emplace_back();
    set.request.boxes.back().min = tf2::toMsg(min);
    set.request.boxes.back().max = tf2::toMsg(max);
    ASSERT_TRUE(callService(std::string(kName) + "/set_box", set));
    ASSERT_TRUE(set.response.info.success) << set.response.info.message;
  }

  static CorrectPoses::Response correct(const nav_msgs::Path& path, bool outside_stays = false) {
    CorrectPoses correct;
    correct.request.path = path;
    correct.request.outside_stays = static_cast<std::uint8_t>(outside_stays);
    EXPECT_TRUE(callService(std::string(kName) + "/correct_poses", correct));
    return correct.response;
  }

  /// As an action.
  static void correctByAction(const nav_msgs::Path& path) {
    actionlib::SimpleActionClient<cuboid_mapping::CorrectPosesAction> client(
        std::string(kName) + "/correct_poses", true);
    ASSERT_TRUE(client.waitForServer(ros::Duration(kDeadline_s)));
    cuboid_mapping::CorrectPosesGoal goal;
    goal.path = path;
    client.sendGoal(goal);
    ASSERT_TRUE(client.waitForResult(ros::Duration(kDeadline_s)));
    EXPECT_EQ(client.getState(), actionlib::SimpleClientGoalState::SUCCEEDED);
    EXPECT_EQ(client.getResult()->clouds, 1U * kNumClouds);
  }

  /// The map of a node that had the right poses from the beginning.
  [[nodiscard]] Voxels mapFromScratch() {
    end(SIGINT);
    ros::param::del(kName);
    startKeeping();
    driveAll(truth);
    return saveMap();
  }

  /// The map that ~correct_poses makes, of a node with these parameters.
  [[nodiscard]] Voxels correctedMap(const std::vector<std::string>& parameters) {
    startKeeping(parameters);
    driveAll(drifted);
    const Voxels before = saveMap();
    const CorrectPoses::Response answer = correct(pathOf(0, kNumClouds));
    EXPECT_TRUE(answer.info.success) << answer.info.message;
    EXPECT_EQ(answer.clouds, 1U * kNumClouds);
    EXPECT_EQ(answer.outside, 0U);
    EXPECT_GT(answer.max_shift, 0.5);
    Voxels after = saveMap();
    EXPECT_NE(after, before);
    return after;
  }

  ros::Publisher paths_ = nh_.advertise<nav_msgs::Path>("/corrected_path", 10);
};

TEST_P(NodeCorrections, MakeTheMapOfTheNewPosesWithItsEditsAndLocks) {
  const Voxels corrected = correctedMap({});
  EXPECT_EQ(figure("clouds kept"), kNumClouds);
  EXPECT_LT(figure("clouds kept, bytes"), figure("clouds kept, points") * 12 / 5);
  const Voxels expected = mapFromScratch();
  ASSERT_GT(expected.size(), 10000U);
  EXPECT_EQ(corrected, expected);
  // The locked box is whole, though clouds have seen it empty.
  EXPECT_GT(expected.at({12, 7, 2}), 0.0F);
}

TEST_P(NodeCorrections, ReachWhatIsOnDisk) {
  if (GetParam()) GTEST_SKIP() << "the same for the nodelet";
  const Voxels corrected =
      correctedMap({"_window/frame:=base", "_window/size:=4.0", "_window/margin:=0.5",
                    "_window/file:=" + (folder_ / "map.sqlite")});
  EXPECT_EQ(corrected, mapFromScratch());
}

TEST_P(NodeCorrections, ComeFromATopicWhileCloudsGoOn) {
  if (GetParam()) GTEST_SKIP() << "the same for the nodelet";
  constexpr int kNumLater = 20;
  startKeeping();
  driveAll(truth);
  sendAll(kNumClouds, kNumClouds + kNumLater, truth);
  const Voxels expected = saveMap();
  end(SIGINT);
  startKeeping();
  ASSERT_TRUE(waitFor([this] { return paths_.getNumSubscribers() > 0; }));
  driveAll(drifted);
  paths_.publish(pathOf(0, kNumClouds));
  sendAll(kNumClouds, kNumClouds + kNumLater, truth);
  // Clouds that come before the first correction is made go along with its last pose: this path has them, too.
  paths_.publish(pathOf(0, kNumClouds + kNumLater));
  EXPECT_TRUE(waitFor([&] { return saveMap() == expected; }));
  EXPECT_EQ(figure("clouds dropped"), 0);
}

TEST_P(NodeCorrections, AreAnActionToo) {
  if (GetParam()) GTEST_SKIP() << "the same for the nodelet";
  startKeeping();
  driveAll(drifted);
  correctByAction(pathOf(0, kNumClouds));
  const CorrectPoses::Response again = correct(pathOf(0, kNumClouds));
  EXPECT_TRUE(again.info.success) << again.info.message;
  EXPECT_EQ(again.max_shift, 0.0);
}

TEST_P(NodeCorrections, AreRefusedWithAReason) {
  if (GetParam()) GTEST_SKIP() << "the same for the nodelet";
  startKeeping();
  const CorrectPoses::Response empty = correct(pathOf(0, kNumClouds));
  EXPECT_NE(empty.info.message.find("no cloud is kept"), std::string::npos) << empty.info.message;
  driveAll(drifted);
  const Voxels before = saveMap();
  nav_msgs::Path foreign = pathOf(0, kNumClouds);
  foreign.header.frame_id = "camera_init";
  EXPECT_NE(correct(foreign).info.message.find("'camera_init'"), std::string::npos);
  EXPECT_NE(correct(pathOf(1000, 1010)).info.message.find("within the new poses"),
            std::string::npos);
  EXPECT_FALSE(correct({}).info.success);
  EXPECT_EQ(saveMap(), before);
  // ~move_map takes the map along, and what was seen before stays in it.
  cuboid_mapping::MoveMap move;
  move.request.transform = tf2::eigenToTransform(makeTranslation(0.3, 0.0, 0.0)).transform;
  move.request.stamp = stampOf(kNumClouds);
  ASSERT_TRUE(callService(std::string(kName) + "/move_map", move));
  ASSERT_TRUE(move.response.info.success) << move.response.info.message;
  EXPECT_FALSE(correct(pathOf(0, kNumClouds)).info.success);
  EXPECT_EQ(figure("clouds kept"), 0);
  EXPECT_EQ(figure("clouds no longer kept"), kNumClouds);
}

INSTANTIATE_TEST_SUITE_P(AsNodeAndNodelet, NodeCorrections, ::testing::Bool());

}  // namespace
}  // namespace cuboid_mapping_ros::test

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_node_corrections");
  const ros::NodeHandle keeps_ros_alive;
  return RUN_ALL_TESTS();
}
