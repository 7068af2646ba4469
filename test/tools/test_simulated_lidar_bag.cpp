// SPDX-License-Identifier: BSD-3-Clause
#include "read_bag.h"
#include "run_program.h"
#include "simulation/world.h"

#include <gtest/gtest.h>
#include <sensor_msgs/point_cloud2_iterator.h>
#include <tf2_eigen/tf2_eigen.h>

#include <cmath>
#include <filesystem>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::World;
using cuboid_mapping::test::limitFileSize;
using cuboid_mapping::test::Program;
using cuboid_mapping::test::ProgramEnd;
using cuboid_mapping::test::readText;
using cuboid_mapping::test::runProgram;
using cuboid_mapping::test::TemporaryFolder;
using cuboid_mapping::test::waitForFile;

ProgramEnd writeBag(const std::string& bag, std::vector<std::string> options,
                    const std::function<void()>& prepare = {}) {
  options.insert(options.begin(), {SIMULATED_LIDAR_PROGRAM, "--bag", bag});
  return runProgram(options, prepare);
}

const std::vector<std::string> kSmall = {"--duration", "2", "--rings", "8", "--columns", "60"};

std::vector<std::string> smallWith(const std::vector<std::string>& more) {
  std::vector<std::string> options = kSmall;
  options.insert(options.end(), more.begin(), more.end());
  return options;
}

class SimulatedLidarBag : public testing::Test {
 protected:
  TemporaryFolder folder_;
  std::string bag_ = folder_ / "drive.bag";
};

TEST_F(SimulatedLidarBag, holdsACloudPerPeriodOfTheDuration) {
  const ProgramEnd end = writeBag(bag_, smallWith({"--cloud-rate", "4"}));
  ASSERT_EQ(end.status, 0) << end.err;
  EXPECT_EQ(end.err, "");  // a progress bar is for terminals
  EXPECT_NE(end.out.find("8 clouds"), std::string::npos) << end.out;
  EXPECT_EQ(folder_.list(), std::vector<std::string>{"drive.bag"});
  const BagContents contents = readBag(bag_);
  ASSERT_EQ(contents.clouds.size(), 8U);
  EXPECT_EQ(contents.transforms.size(), 8U);
  for (std::size_t i = 0; i < contents.clouds.size(); ++i) {
    const auto& [topic, cloud, has_transform, T_map_cloud] = contents.clouds[i];
    EXPECT_EQ(topic, "/cloud");
    EXPECT_EQ(cloud.header.stamp, ros::Time(1000) + ros::Duration(0.25 * i));
    EXPECT_EQ(cloud.header.frame_id, "lidar");
    EXPECT_EQ(cloud.height, 8U);
    EXPECT_EQ(cloud.width, 60U);
    EXPECT_EQ(cloud.row_step, cloud.width * cloud.point_step);
    EXPECT_EQ(cloud.data.size(), cloud.height * cloud.row_step);
    EXPECT_FALSE(cloud.is_dense);
    EXPECT_TRUE(has_transform) << i;
  }
}

TEST_F(SimulatedLidarBag, hasPosesOfTheDriveAndOneLatchedMount) {
  ASSERT_EQ(writeBag(bag_, kSmall).status, 0);
  const BagContents contents = readBag(bag_);
  ASSERT_EQ(contents.static_transforms.size(), 1U);
  EXPECT_TRUE(contents.is_static_latched);
  const auto& mount = contents.static_transforms[0].transforms.at(0);
  EXPECT_EQ(mount.header.frame_id, "base_link");
  EXPECT_EQ(mount.child_frame_id, "lidar");
  const World world(1);
  ASSERT_EQ(contents.transforms.size(), 20U);
  for (std::size_t i = 0; i < contents.transforms.size(); ++i) {
    const auto& transform = contents.transforms[i].transforms.at(0);
    EXPECT_EQ(transform.header.frame_id, "map");
    EXPECT_EQ(transform.child_frame_id, "base_link");
    const Eigen::Isometry3d expected = world.computeRobotPose(0.1 * i);
    EXPECT_TRUE(tf2::transformToEigen(transform).isApprox(expected, 1e-9)) << i;
  }
}

TEST_F(SimulatedLidarBag, isOfARobotWithANameThatIsAhead) {
  const std::string ahead = folder_ / "ahead.bag";
  ASSERT_EQ(writeBag(bag_, kSmall).status, 0);
  ASSERT_EQ(writeBag(ahead, smallWith({"--robot", "robot2", "--head-start", "1.5"})).status, 0);
  const BagContents contents = readBag(ahead);
  ASSERT_EQ(contents.clouds.size(), 20U);
  EXPECT_EQ(contents.clouds[0].message.header.frame_id, "robot2/lidar");
  EXPECT_TRUE(contents.clouds[0].has_transform);
  EXPECT_EQ(contents.static_transforms.at(0).transforms.at(0).header.frame_id, "robot2/base_link");
  const Eigen::Isometry3d start = World(1).computeRobotPose(1.5);
  const auto& pose = contents.transforms[0].transforms.at(0);
  EXPECT_EQ(pose.child_frame_id, "robot2/base_link");
  EXPECT_TRUE(tf2::transformToEigen(pose).isApprox(start, 1e-9));
  EXPECT_FALSE(contents.clouds[0].message.data == readBag(bag_).clouds[0].message.data);
}

TEST_F(SimulatedLidarBag, hasPointsOnTheSurfacesOfTheWorld) {
  ASSERT_EQ(writeBag(bag_, smallWith({"--seed", "4", "--noise", "0"})).status, 0);
  const World world(4);
  int returns = 0;
  const BagContents contents = readBag(bag_);
  for (std::size_t i = 0; i < contents.clouds.size(); ++i) {
    const auto& cloud = contents.clouds[i].message;
    const auto solids = world.computeSolids(0.1 * i);
    const Eigen::Isometry3d T_map_lidar = tf2::transformToEigen(contents.clouds[i].T_map_cloud);
    const std::size_t num_points = cloud.width * cloud.height;
    sensor_msgs::PointCloud2ConstIterator<float> xyz(cloud, "x");
    sensor_msgs::PointCloud2ConstIterator<float> intensity(cloud, "intensity");
    for (std::size_t point = 0; point < num_points; ++point, ++xyz, ++intensity) {
      if (std::isnan(xyz[0])) continue;
      const Eigen::Vector3d position = T_map_lidar * Eigen::Vector3d(xyz[0], xyz[1], xyz[2]);
      double distance = 1.0;
      for (const auto& solid : solids) {
        distance = std::min(distance,
                            std::abs(cuboid_mapping::computeSignedDistance(solid.shape, position)));
      }
      ASSERT_LT(distance, 1e-4);
      ASSERT_GT(*intensity, 0.0F);
      ++returns;
    }
  }
  EXPECT_GT(returns, 5000);
}

TEST_F(SimulatedLidarBag, isTheSameForTheSameSeedOnly) {
  const std::string again = folder_ / "again.bag";
  const std::string other = folder_ / "other.bag";
  ASSERT_EQ(writeBag(bag_, smallWith({"--seed", "3"})).status, 0);
  ASSERT_EQ(writeBag(again, smallWith({"--seed", "3"})).status, 0);
  ASSERT_EQ(writeBag(other, smallWith({"--seed", "4"})).status, 0);
  EXPECT_TRUE(readText(bag_) == readText(again));
  const BagContents first = readBag(bag_);
  const BagContents second = readBag(other);
  ASSERT_EQ(first.clouds.size(), second.clouds.size());
  for (std::size_t i = 0; i < first.clouds.size(); ++i) {
    EXPECT_FALSE(first.clouds[i].message.data == second.clouds[i].message.data) << i;
  }
}

TEST_F(SimulatedLidarBag, replacesAnOlderBagOnlyWhenComplete) {
  ASSERT_EQ(writeBag(bag_, kSmall).status, 0);
  const std::string before = readText(bag_);
  const ProgramEnd failed =
      writeBag(bag_, smallWith({"--seed", "2"}), [] { limitFileSize(50000); });
  EXPECT_EQ(failed.status, 1);
  EXPECT_TRUE(readText(bag_) == before);
  ASSERT_EQ(writeBag(bag_, smallWith({"--seed", "2"})).status, 0);
  EXPECT_FALSE(readText(bag_) == before);
}

TEST_F(SimulatedLidarBag, leavesNothingBehindOnAFullDisk) {
  // The first limit is met in the clouds, the second in the index at the end of the bag.
  ASSERT_EQ(writeBag(bag_, kSmall).status, 0);
  const std::size_t size = std::filesystem::file_size(bag_);
  std::filesystem::remove(bag_);
  for (const std::size_t limit : {std::size_t{50000}, size - 100}) {
    const ProgramEnd end = writeBag(bag_, kSmall, [=] { limitFileSize(limit); });
    EXPECT_EQ(end.status, 1) << limit;
    EXPECT_NE(end.err.find("cannot write " + bag_), std::string::npos) << end.err;
    EXPECT_TRUE(folder_.list().empty()) << limit;
  }
}

TEST_F(SimulatedLidarBag, saysWhyAFileCannotBeWritten) {
  const ProgramEnd missing = writeBag(folder_ / "no/such/folder.bag", kSmall);
  EXPECT_EQ(missing.status, 1);
  EXPECT_NE(missing.err.find("No such file or directory"), std::string::npos) << missing.err;
  std::filesystem::create_directory(bag_);
  const ProgramEnd folder = writeBag(bag_, kSmall);
  EXPECT_EQ(folder.status, 1);
  EXPECT_NE(folder.err.find("Is a directory"), std::string::npos) << folder.err;
}

TEST_F(SimulatedLidarBag, leavesNothingBehindOnCtrlC) {
  for (const int signal_number : {SIGINT, SIGTERM}) {
    Program program({SIMULATED_LIDAR_PROGRAM, "--bag", bag_, "--duration", "100000"});
    ASSERT_TRUE(waitForFile(bag_ + ".partial"));
    program.send(signal_number);
    const ProgramEnd end = program.finish();
    EXPECT_EQ(end.status, 128 + signal_number);
    EXPECT_EQ(end.err, "simulated_lidar: interrupted\n");
    EXPECT_TRUE(folder_.list().empty());
  }
}

TEST_F(SimulatedLidarBag, refusesBadValues) {
  const std::pair<std::vector<std::string>, std::string> cases[] = {
      {{}, "duration = 0"},
      {{"--duration", "-1"}, "duration = -1"},
      {{"--duration", "nan"}, "--duration nan"},
      {{"--duration", "soon"}, "soon"},
      {{"--rings", "0", "--noise", "2"}, "noise = 2: must be from 0 to 1; duration = 0"},
      {{"--duration", "1", "--rings", "0"}, "rings = 0"},
      {{"--duration", "1", "--columns", "1.5"}, "1.5"},
      {{"--duration", "1", "--cloud-rate", "0"}, "cloud_rate = 0"},
      {{"--duration", "1", "--noise", "-0.01"}, "noise = -0.01"},
      {{"--duration", "1", "--max-range", "inf"}, "max_range = inf"},
      {{"--duration", "1", "--head-start", "-1"}, "head_start = -1"},
      {{"--duration", "1", "--robot", "/robot"}, "robot = /robot"},
      {{"--duration", "1", "--seed", "-1"}, "--seed -1"},
      {{"--duration", "1", "_rings:=4"}, "_rings:=4"},
      {{"--duration", "1", "--fast"}, "--fast"},
  };
  for (const auto& [options, message] : cases) {
    const ProgramEnd end = writeBag(bag_, options);
    EXPECT_EQ(end.status, 1) << message;
    EXPECT_NE(end.err.find(message), std::string::npos) << end.err;
    EXPECT_TRUE(folder_.list().empty()) << message;
  }
}

TEST(SimulatedLidar, needsABagForTheOptionsOfABag) {
  const ProgramEnd end = runProgram({SIMULATED_LIDAR_PROGRAM, "--seed", "3"});
  EXPECT_EQ(end.status, 1);
  EXPECT_NE(end.err.find("--seed requires --bag"), std::string::npos) << end.err;
}

TEST(SimulatedLidar, explainsItself) {
  const ProgramEnd end = runProgram({SIMULATED_LIDAR_PROGRAM, "--help"});
  EXPECT_EQ(end.status, 0);
  for (const char* word : {"--bag", "--duration", "publish_clock"}) {
    EXPECT_NE(end.out.find(word), std::string::npos) << word;
  }
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
