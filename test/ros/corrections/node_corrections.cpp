// SPDX-License-Identifier: BSD-3-Clause
// A running node whose robot drifts: ~correct_poses and corrected_path restore the map of the right poses.
// Needs the feature window.
#include "cuboid_mapping/CorrectPoses.h"
#include "cuboid_mapping/MoveMap.h"
#include "cuboid_mapping/SetBox.h"
#include "ros/driven_node.h"
#include "ros/log_probe.h"

#include <nav_msgs/Path.h>

#include <chrono>
#include <filesystem>
#include <map>
#include <thread>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::Cell;
using cuboid_mapping::CorrectPoses;
using cuboid_mapping::SetBox;
using Voxels = std::map<Cell, float>;

constexpr int kNumClouds = 30;
constexpr int kNumLater = 20;  ///< Clouds of a second part of the drive.

/// Pose of the robot at a cloud: it drives along a curve.
Eigen::Isometry3d truth(int i) {
  return Eigen::Translation3d(0.3 * i, 0.01 * i * i, 0.0) *
         Eigen::AngleAxisd(0.05 * i, Eigen::Vector3d::UnitZ());
}

/// Pose from its odometry.
Eigen::Isometry3d drifted(int i) {
  return truth(i) * Eigen::Translation3d(0.02 * i, -0.013 * i, 0.004 * i) *
         Eigen::AngleAxisd(0.004 * i, Eigen::Vector3d(0.1, 0.2, 1.0).normalized());
}

ros::Time stampOf(int i) { return ros::Time(100.0 + 0.1 * i); }

class NodeCorrections : public DrivenNode {
 protected:
  using Pose = Eigen::Isometry3d (*)(int);

  void startKeeping(const std::vector<std::string>& others = {}) {
    std::vector<std::string> parameters{"_keep_clouds/memory:=50", "_keep_clouds/body_frame:=base"};
    parameters.insert(parameters.end(), others.begin(), others.end());
    start(parameters);
  }

  /// The right poses of some clouds.
  [[nodiscard]] nav_msgs::Path pathOf(int begin, int end) const {
    nav_msgs::Path path;
    path.header.frame_id = "map";
    for (int i = begin; i < end; ++i) {
      path.poses.emplace_back();
      path.poses.back().header.stamp = stampOf(i);
      path.poses.back().pose = tf2::toMsg(Eigen::Isometry3d(T_map_start_ * truth(i)));
    }
    return path;
  }

  void send(int i, Pose pose) {
    tf2_msgs::TFMessage tf;
    // The lidar is mounted at an angle.
    tf.transforms.push_back(makeTransform("map", "base", T_map_start_ * pose(i), stampOf(i)));
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

  /// Sends clouds, with an edit and a locked box in between.
  void driveAll(Pose pose) {
    sendAll(0, 10, pose);
    setBox(SetBox::Request::OCCUPIED, 1, {1.0, 0.5, 0.0}, {1.4, 0.9, 0.4});
    sendAll(10, 20, pose);
    setBox(SetBox::Request::UNKNOWN, 0, {2.0, 0.0, -1.0}, {3.0, 3.0, 1.0});
    sendAll(20, kNumClouds, pose);
  }

  static CorrectPoses::Response correct(const nav_msgs::Path& path, bool outside_stays = false) {
    CorrectPoses correct;
    correct.request.path = path;
    correct.request.outside_stays = static_cast<std::uint8_t>(outside_stays);
    EXPECT_TRUE(callService(std::string(kName) + "/correct_poses", correct));
    return correct.response;
  }

  /// The map of a node that had the right poses from the beginning.
  [[nodiscard]] Voxels mapFromScratch() {
    end(SIGINT);
    ros::param::del(kName);
    startKeeping();
    driveAll(truth);
    return saveMap();
  }

  /// The map after ~correct_poses, in a node with these parameters.
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

  /// Moves the map, as after a jump of the localization.
  void moveMap(const Eigen::Isometry3d& T_new_old, const ros::Time& stamp) {
    cuboid_mapping::MoveMap move;
    move.request.transform = tf2::eigenToTransform(T_new_old).transform;
    move.request.stamp = stamp;
    ASSERT_TRUE(callService(std::string(kName) + "/move_map", move));
    ASSERT_TRUE(move.response.info.success) << move.response.info.message;
  }

  /// A drive whose map is moved to another frame on the way. @param corrects  Corrects before that, and at the end.
  [[nodiscard]] Voxels mapInTurns(Pose pose, bool corrects) {
    driveAll(pose);
    if (corrects) {
      EXPECT_TRUE(correct(pathOf(0, kNumClouds)).info.success);
    }
    T_map_start_ = Eigen::Translation3d(0.7, -0.4, 0.2) *
                   Eigen::AngleAxisd(M_PI / 2.0, Eigen::Vector3d::UnitZ());
    moveMap(T_map_start_, stampOf(kNumClouds) - ros::Duration(0.05));
    sendAll(kNumClouds, kNumClouds + kNumLater, pose);
    if (corrects) {
      const auto answer = correct(pathOf(0, kNumClouds + kNumLater));
      EXPECT_TRUE(answer.info.success) << answer.info.message;
      EXPECT_EQ(answer.clouds, 1U * kNumLater);
    }
    return saveMap();
  }

  /// Kills the node some time after the start of a correction, and restarts it. @return Its map.
  [[nodiscard]] Voxels mapAfterAKill(const std::vector<std::string>& parameters, double after_s) {
    std::thread call([this] {
      CorrectPoses correct;
      correct.request.path = pathOf(0, kNumClouds);
      ros::service::call(std::string(kName) + "/correct_poses", correct);  // It may have no answer.
    });
    std::this_thread::sleep_for(std::chrono::duration<double>(after_s));
    end(SIGKILL);
    call.join();
    startKeeping(parameters);
    return saveMap();
  }

  /// Kills the node at several moments of a correction and after it: the file has the map from before or the corrected one.
  void killMany(const std::string& file, const std::vector<std::string>& parameters) {
    constexpr int kNumKills = 5;
    Voxels after;
    double time_s = 0.0;
    int num_before = 0;
    for (int kill = -1; kill < kNumKills; ++kill) {
      startKeeping(parameters);
      driveAll(drifted);
      const Voxels before = saveMap();
      ASSERT_TRUE(waitFor([&] { return voxelsIn(file) == before; })) << "it is on the disk";
      if (kill < 0) {
        time_s = correct(pathOf(0, kNumClouds)).seconds;
        after = saveMap();
        ASSERT_NE(after, before);
      } else {
        const Voxels found = mapAfterAKill(parameters, 1.5 * time_s * kill / kNumKills);
        ASSERT_TRUE(found == before || found == after) << kill;
        num_before += found == before ? 1 : 0;
      }
      end(SIGKILL);
      for (const char* part : {"", "-wal", "-shm"}) std::filesystem::remove(file + part);
    }
    EXPECT_GT(num_before, 0);
  }

  /// Voxels that a node killed now would leave in its file, which it may be writing.
  [[nodiscard]] Voxels voxelsIn(const std::string& file) const {
    const std::string copy = folder_ / ("copy" + std::filesystem::path(file).extension().string());
    try {
      for (const std::string part : {"", "-wal"}) {  // Files of SQLite.
        std::filesystem::remove(copy + part);
        if (std::filesystem::exists(file + part)) {
          std::filesystem::copy_file(file + part, copy + part);
        }
      }
      return cuboid_mapping::test::voxelsOf(cuboid_mapping::readMapFile(copy).snapshot.bricks);
    } catch (const std::runtime_error&) {  // The file is not there yet.
      return {};
    }
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
  // The locked box is whole, though clouds have seen the place empty.
  EXPECT_GT(expected.at({12, 7, 2}), 0.0F);
}

TEST_P(NodeCorrections, MoveEditsAlongWhereTheyAreAskedTo) {
  if (GetParam()) GTEST_SKIP() << "the same for the nodelet";
  startKeeping();
  sendAll(0, 10, drifted);
  setBox(SetBox::Request::OCCUPIED, 1, {1.0, 0.5, 0.0}, {1.4, 0.9, 0.4});
  CorrectPoses correct;
  correct.request.path = pathOf(0, 10);
  correct.request.edits_move = 1;
  ASSERT_TRUE(callService(std::string(kName) + "/correct_poses", correct));
  ASSERT_TRUE(correct.response.info.success) << correct.response.info.message;
  const Eigen::Vector3d center(1.2, 0.7, 0.2);
  const Eigen::Vector3d shift = 10.0 * (truth(9) * drifted(9).inverse() * center - center);
  const Cell moved{static_cast<std::int32_t>(std::lround(shift.x())),
                   static_cast<std::int32_t>(std::lround(shift.y())),
                   static_cast<std::int32_t>(std::lround(shift.z()))};
  ASSERT_FALSE((moved == Cell{0, 0, 0}));
  sendAll(10, kNumClouds, truth);  // Beams pass it, but it is locked.
  const Voxels voxels = saveMap();
  const auto isOccupied = [&](const Cell& cell) {
    const auto found = voxels.find(cell);
    return found != voxels.end() && found->second > 3.0F;
  };
  for (const Cell& corner : {Cell{10, 5, 0}, Cell{13, 8, 3}}) {
    EXPECT_TRUE(isOccupied(corner + moved)) << corner + moved;
  }
  EXPECT_FALSE(isOccupied(Cell{10, 5, 0} + moved - Cell{1, 0, 0}));
}

TEST_P(NodeCorrections, ReachWhatIsOnDisk) {
  if (GetParam()) GTEST_SKIP() << "the same for the nodelet";
  const Voxels corrected = correctedMap(
      {"_window/frame:=base", "_window/size:=4.0", "_window/file:=" + (folder_ / "map.sqlite")});
  EXPECT_EQ(corrected, mapFromScratch());
}

TEST_P(NodeCorrections, TakeTurnsWithMovesOfTheMap) {
  if (GetParam()) GTEST_SKIP() << "the same for the nodelet";
  const std::vector<std::string> window{"_window/frame:=base", "_window/size:=4.0",
                                        "_window/file:=" + (folder_ / "map.sqlite")};
  startKeeping();
  const Voxels expected = mapInTurns(truth, false);
  for (const auto& parameters : {std::vector<std::string>(), window}) {
    end(SIGINT);
    ros::param::del(kName);
    T_map_start_.setIdentity();
    startKeeping(parameters);
    EXPECT_EQ(mapInTurns(drifted, true), expected) << parameters.size();
  }
}

TEST_P(NodeCorrections, LeaveAWholeMapWhereTheyAreKilled) {
  if (GetParam()) GTEST_SKIP() << "the same for the nodelet";
  const std::string file = folder_ / "map.cuboids";
  killMany(file, {"_autosave_file:=" + file, "_autosave_period:=1.0"});
}

TEST_P(NodeCorrections, LeaveAWholeStoreWhereTheyAreKilled) {
  if (GetParam()) GTEST_SKIP() << "the same for the nodelet";
  const std::string file = folder_ / "map.sqlite";
  killMany(file, {"_window/frame:=base", "_window/size:=4.0", "_window/file:=" + file,
                  "_autosave_period:=1.0"});
}

TEST_P(NodeCorrections, ComeFromATopicWhileCloudsGoOn) {
  if (GetParam()) GTEST_SKIP() << "the same for the nodelet";
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
  // Clouds that arrive before the first correction is made follow its last pose: this path has them, too.
  paths_.publish(pathOf(0, kNumClouds + kNumLater));
  EXPECT_TRUE(waitFor([&] { return saveMap() == expected; }));
  EXPECT_EQ(figure("clouds dropped"), 0);
}

TEST_P(NodeCorrections, AreNotAskedForByAnEmptyPath) {
  if (GetParam()) GTEST_SKIP() << "the same for the nodelet";
  LogProbe log;
  startKeeping();
  driveAll(truth);
  ASSERT_TRUE(waitFor([this] { return paths_.getNumSubscribers() > 0; }));
  paths_.publish(nav_msgs::Path());
  nav_msgs::Path foreign = pathOf(0, kNumClouds);
  foreign.header.frame_id = "camera_init";
  paths_.publish(foreign);
  EXPECT_TRUE(log.waitForLine("poses not corrected: the path is in frame 'camera_init'"));
}

TEST_P(NodeCorrections, FollowKeyframesThatAreFarApart) {
  if (GetParam()) GTEST_SKIP() << "the same for the nodelet";
  LogProbe log;
  startKeeping({"_tf_gap:=0.15"});
  driveAll(drifted);
  ASSERT_TRUE(waitFor([this] { return paths_.getNumSubscribers() > 0; }));
  paths_.publish(pathOf(1000, 1010));
  EXPECT_TRUE(log.waitForLine("no kept cloud was taken within the new poses"));
  nav_msgs::Path keyframes = pathOf(0, 0);
  for (const int i : {0, 10, 20, kNumClouds - 1}) {
    keyframes.poses.push_back(pathOf(i, i + 1).poses.front());
    keyframes.poses.back().header.stamp += ros::Duration(0, 200);  // Not exactly a cloud's.
  }
  paths_.publish(keyframes);
  EXPECT_TRUE(log.waitForLine("poses corrected: 30 kept clouds"));
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
  // ~move_map moves the map, and earlier observations stay in it.
  moveMap(makeTranslation(0.3, 0.0, 0.0), stampOf(kNumClouds));
  EXPECT_FALSE(correct(pathOf(0, kNumClouds)).info.success);
  EXPECT_EQ(figure("clouds kept"), 0);
  EXPECT_EQ(figure("clouds no longer kept"), kNumClouds);
}

INSTANTIATE_TEST_SUITE_P(AsNodeAndNodelet, NodeCorrections, ::testing::Bool());

}  // namespace
}  // namespace cuboid_mapping_ros::test
