// SPDX-License-Identifier: BSD-3-Clause
// bag_to_map --poses: the map of a bag with drifting tf and corrected poses equals that of a bag whose tf has them.
#include "bag_output.h"
#include "support/random.h"
#include "tools/run_program.h"
#include "transform_message.h"

#include <geometry_msgs/PoseStamped.h>
#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <nav_msgs/Path.h>
#include <tf2_msgs/TFMessage.h>

#include <fstream>
#include <iomanip>
#include <limits>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::test::mentions;
using cuboid_mapping::test::ProgramEnd;
using cuboid_mapping::test::Random;
using cuboid_mapping::test::readText;
using cuboid_mapping::test::runProgram;
using cuboid_mapping::test::TemporaryFolder;

constexpr int kNumClouds = 8;

ros::Time stampOf(int number) { return {1600000000U + static_cast<unsigned>(number), 123456789U}; }

/// Pose of the robot, or its drifting odometry.
Eigen::Isometry3d poseOf(int number, bool drifts) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  const double drift = drifts ? 0.1 * number : 0.0;
  pose.translation() = Eigen::Vector3d(0.5 * number, drift, 0.0);
  pose.linear() =
      Eigen::AngleAxisd(0.125 * number + drift, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return pose;
}

geometry_msgs::PoseStamped toPose(const Eigen::Isometry3d& pose, const ros::Time& stamp) {
  geometry_msgs::PoseStamped message;
  message.header = makeHeader("map", stamp);
  message.pose = tf2::toMsg(pose);
  return message;
}

class BagPoses : public ::testing::Test {
 protected:
  BagPoses() {
    writeBag(folder_ / "drifting.bag", true);
    writeBag(folder_ / "right.bag", false);
    std::ofstream file(folder_ / "poses.txt");
    file << "# stamp x y z qx qy qz qw\n" << std::setprecision(17);
    for (int i = 0; i < kNumClouds; ++i) {
      const Eigen::Isometry3d pose = poseOf(i, false);
      const Eigen::Quaterniond rotation(pose.linear());
      file << stampOf(i) << ' ' << pose.translation().transpose() << ' ' << rotation.x() << ' '
           << rotation.y() << ' ' << rotation.z() << ' ' << rotation.w() << '\n';
    }
    expected_ = map("right.bag", {});
  }

  static void writeBag(const std::string& name, bool drifts, bool has_stamps = true) {
    Random random(81);
    BagOutput bag(name, name);
    tf2_msgs::TFMessage mount;
    mount.transforms.push_back(toTransformMessage(
        Eigen::Isometry3d(Eigen::Translation3d(0.25, 0.0, 0.5)), stampOf(0), "base_link", "lidar"));
    bag.writeLatched("/tf_static", stampOf(0), mount, "/mount");
    nav_msgs::Path path;
    path.header = makeHeader("map", stampOf(0));
    for (int i = 0; i < kNumClouds; ++i) {
      tf2_msgs::TFMessage tf;
      tf.transforms.push_back(
          toTransformMessage(poseOf(i, drifts), stampOf(i), "map", "base_link"));
      bag.write("/tf", stampOf(i), tf);
      std::vector<Eigen::Vector3d> points;
      for (int k = 0; k < 500; ++k) {
        points.emplace_back(random.real(-8, 8), random.real(-8, 8), random.real(-1, 2));
      }
      const ros::Time stamp = has_stamps ? stampOf(i) : ros::Time();
      bag.write("/points", stampOf(i), toCloud(points, makeHeader("lidar", stamp)));
      nav_msgs::Odometry odometry;
      odometry.header = makeHeader("map", stampOf(i));
      odometry.child_frame_id = "base_link";
      odometry.pose.pose = toPose(poseOf(i, false), stampOf(i)).pose;
      bag.write("/odometry", stampOf(i), odometry);
      // It has other poses until the loop is closed.
      path.poses.push_back(toPose(poseOf(i, true), stampOf(i)));
      if (i + 1 == kNumClouds) {
        for (int k = 0; k <= i; ++k)
          path.poses[static_cast<std::size_t>(k)] = toPose(poseOf(k, false), stampOf(k));
      }
      bag.write("/path", stampOf(i), path);
    }
    bag.close();
  }

  ProgramEnd run(const std::string& bag, const std::vector<std::string>& options) {
    std::vector<std::string> words{BAG_TO_MAP_PROGRAM,      folder_ / bag, "-o",
                                   folder_ / "map.cuboids", "--set",       "resolution=0.1"};
    words.insert(words.end(), options.begin(), options.end());
    return runProgram(words);
  }
  /// The bytes of a map.
  std::string map(const std::string& bag, const std::vector<std::string>& options) {
    const ProgramEnd end = run(bag, options);
    EXPECT_EQ(end.status, 0) << end.err;
    return readText(folder_ / "map.cuboids");
  }

  TemporaryFolder folder_;
  std::string expected_;
};

// tf's newest transform, which a node takes for them, is that of the end of the bag.
TEST_F(BagPoses, areThoseOfTheTimeOfRecordingForCloudsWithoutStamp) {
  writeBag(folder_ / "unstamped.bag", false, false);
  EXPECT_EQ(map("unstamped.bag", {}), expected_);
  EXPECT_EQ(map("unstamped.bag", {"--poses", "/path", "--poses-of", "base_link"}), expected_);
  EXPECT_TRUE(mentions(run("unstamped.bag", {}).err, "/points: clouds without a stamp"));
}

TEST_F(BagPoses, makeTheMapThatRightTransformsMake) {
  EXPECT_NE(map("drifting.bag", {}), expected_);
  const std::string file = folder_ / "poses.txt";
  EXPECT_EQ(map("drifting.bag", {"--poses", file, "--poses-of", "base_link"}), expected_);
  EXPECT_EQ(map("drifting.bag", {"--poses", "/path", "--poses-of", "base_link"}), expected_)
      << "the last path";
  EXPECT_EQ(map("drifting.bag", {"--poses", "odometry"}), expected_) << "which names its body";
  EXPECT_NE(map("drifting.bag", {"--poses", file}), expected_) << "as poses of the lidar";
}

TEST_F(BagPoses, LeaveOutCloudsOutsideTheirTime) {
  std::ofstream(folder_ / "short.txt")
      << "1600000001.5 0 0 0 0 0 0 1\n1600000002.25 0.25 0 0 0 0 0 1\n1600000003 0.5 0 0 0 0 0 1\n"
         "1600000003.75 0.75 0 0 0 0 0 1\n1600000004.5 1 0 0 0 0 0 1\n";
  const ProgramEnd end = run("drifting.bag", {"--poses", folder_ / "short.txt"});
  EXPECT_EQ(end.status, 0) << end.err;
  EXPECT_NE(end.out.find("3 of 8 clouds"), std::string::npos) << end.out;
  EXPECT_NE(end.err.find("5 clouds dropped, no transform: the poses of --poses do not reach to"),
            std::string::npos)
      << end.err;
}

TEST_F(BagPoses, AreRefusedWithASentence) {
  const auto error_of = [&](const std::vector<std::string>& options) {
    const ProgramEnd end = run("drifting.bag", options);
    EXPECT_EQ(end.status, 1);
    return end.err;
  };
  const auto has = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  has(error_of({"--poses", "/none"}), "the bags have /odometry, /path");
  has(error_of({"--poses", "/points"}), "no topic with poses");
  has(error_of({"--poses-of", "base_link"}), "--poses-of needs poses");
  has(error_of({"--poses", "/path", "--set", "frame_id=odom"}),
      "in the frame 'map', but frame_id is 'odom'");
  const std::pair<const char*, const char*> files[] = {
      {"", "has no poses"},
      {"# nothing\n\n", "has no poses"},
      {"1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0\n", "line 2: must be \"stamp x y z"},
      {"1 0 0 nan 0 0 0 1\n", "line 1"},
      {"1 0 0 0 0 0 0 0\n", "line 1"},
      {"x 0 0 0 0 0 0 1\n", "line 1"},
      {"1 0 0 0 0 0 0 1\n1.0 1 0 0 0 0 0 1\n", "is there twice"},
      {"5 0 0 0 0 0 0 1\n", "none of 8 clouds could be used"}};
  for (const auto& [content, text] : files) {
    std::ofstream(folder_ / "bad.txt") << content;
    has(error_of({"--poses", folder_ / "bad.txt"}), text);
  }
}

}  // namespace
}  // namespace cuboid_mapping_ros
