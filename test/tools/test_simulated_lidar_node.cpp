// SPDX-License-Identifier: BSD-3-Clause
// The node simulated_lidar, started by the test when its subscribers are there.
#include "read_bag.h"
#include "run_program.h"

#include <gtest/gtest.h>
#include <nav_msgs/Path.h>
#include <ros/ros.h>
#include <rosgraph_msgs/Clock.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::test::Program;
using cuboid_mapping::test::ProgramEnd;
using cuboid_mapping::test::runProgram;
using cuboid_mapping::test::TemporaryFolder;

/// Keeps what the node publishes.
class Recorder {
 public:
  Recorder() {
    clock_subscriber_ = node_.subscribe("/clock", 1000, &Recorder::addClock, this);
    cloud_subscriber_ = node_.subscribe("cloud", 1000, &Recorder::addCloud, this);
    spinner_.start();
  }

  std::vector<ros::Time> clocks() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return clocks_;
  }
  std::vector<sensor_msgs::PointCloud2> clouds() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return clouds_;
  }
  [[nodiscard]] const tf2_ros::Buffer& transforms() const { return buffer_; }

 private:
  void addClock(const rosgraph_msgs::Clock& message) {
    const std::lock_guard<std::mutex> lock(mutex_);
    clocks_.push_back(message.clock);
  }
  void addCloud(const sensor_msgs::PointCloud2& message) {
    const std::lock_guard<std::mutex> lock(mutex_);
    clouds_.push_back(message);
  }

  ros::NodeHandle node_;
  std::mutex mutex_;
  std::vector<ros::Time> clocks_;
  std::vector<sensor_msgs::PointCloud2> clouds_;
  tf2_ros::Buffer buffer_{ros::Duration(1000)};
  tf2_ros::TransformListener listener_{buffer_};
  ros::Subscriber clock_subscriber_;
  ros::Subscriber cloud_subscriber_;
  ros::AsyncSpinner spinner_{1};
};

TEST(SimulatedLidarNode, publishesWhatItWouldWriteIntoABag) {
  const TemporaryFolder folder;
  const std::string bag = folder / "same.bag";
  ASSERT_EQ(runProgram({SIMULATED_LIDAR_PROGRAM, "--bag", bag, "--duration", "6", "--seed", "8",
                        "--rings", "8", "--columns", "60"})
                .status,
            0);
  std::map<ros::Time, BagContents::Cloud> expected;
  for (const BagContents::Cloud& cloud : readBag(bag).clouds) {
    expected.emplace(cloud.message.header.stamp, cloud);
  }

  Recorder recorder;
  const ProgramEnd end =
      runProgram({SIMULATED_LIDAR_PROGRAM, "__name:=lidar_with_clock", "_publish_clock:=true",
                  "_rate:=2", "_duration:=6", "_seed:=8", "_rings:=8", "_columns:=60"});
  ASSERT_EQ(end.status, 0) << end.err;
  const std::vector<sensor_msgs::PointCloud2> clouds = recorder.clouds();
  ASSERT_GE(clouds.size(), 40U);  // of 60: the first may come before the connection is made
  EXPECT_EQ(clouds.back().header.stamp, expected.rbegin()->first);
  std::size_t num_transformed = 0;
  for (const sensor_msgs::PointCloud2& cloud : clouds) {
    const std::string& frame = cloud.header.frame_id;
    const ros::Time stamp = cloud.header.stamp;
    ASSERT_EQ(expected.count(stamp), 1U) << stamp;
    const BagContents::Cloud& in_bag = expected.at(stamp);
    EXPECT_TRUE(cloud.data == in_bag.message.data) << stamp;
    EXPECT_EQ(cloud.fields.size(), in_bag.message.fields.size());
    EXPECT_EQ(frame, in_bag.message.header.frame_id);
    const bool has_transform = recorder.transforms().canTransform("map", frame, stamp);
    // The connection for tf may be made after that for clouds; from then on, none is missing.
    if (!has_transform && num_transformed == 0) continue;
    ASSERT_TRUE(has_transform) << stamp;
    ++num_transformed;
    const auto T_map_cloud = recorder.transforms().lookupTransform("map", frame, stamp);
    EXPECT_EQ(T_map_cloud.transform, in_bag.T_map_cloud.transform) << stamp;
  }
  EXPECT_GE(num_transformed, 30U);
}

TEST(SimulatedLidarNode, isAClockThatGoesOn) {
  Recorder recorder;
  // Slow clouds, so that there are clocks in between; longer than a lap, at a high rate.
  const ProgramEnd end =
      runProgram({SIMULATED_LIDAR_PROGRAM, "__name:=lidar_of_two_laps", "_publish_clock:=true",
                  "_rate:=50", "_duration:=150", "_cloud_rate:=1", "_rings:=2", "_columns:=10"});
  ASSERT_EQ(end.status, 0) << end.err;
  const std::vector<ros::Time> clocks = recorder.clocks();
  ASSERT_GT(clocks.size(), 150U);
  EXPECT_TRUE(std::is_sorted(clocks.begin(), clocks.end()));
  EXPECT_GE(clocks.back(), ros::Time(1000 + 149));
  std::vector<ros::Time> stamps;
  for (const auto& cloud : recorder.clouds()) stamps.push_back(cloud.header.stamp);
  ASSERT_GT(stamps.size(), 100U);
  for (std::size_t i = 1; i < stamps.size(); ++i) {
    EXPECT_EQ(stamps[i] - stamps[i - 1], ros::Duration(1.0)) << i;
    EXPECT_TRUE(std::binary_search(clocks.begin(), clocks.end(), stamps[i])) << stamps[i];
  }
}

TEST(SimulatedLidarNode, followsTheClockOfOthers) {
  Recorder recorder;
  ros::NodeHandle node;
  ros::Publisher publisher = node.advertise<rosgraph_msgs::Clock>("/clock", 10);
  std::atomic<bool> is_running{true};
  std::thread clock([&] {
    rosgraph_msgs::Clock message;
    message.clock = ros::Time(5000);
    while (is_running) {
      publisher.publish(message);
      message.clock += ros::Duration(0.01);
      ros::WallDuration(0.002).sleep();
    }
  });
  const ProgramEnd end = runProgram({SIMULATED_LIDAR_PROGRAM, "__name:=lidar_of_another_clock",
                                     "_duration:=8", "_rings:=4", "_columns:=30"});
  is_running = false;
  clock.join();
  ASSERT_EQ(end.status, 0) << end.err;
  const std::vector<sensor_msgs::PointCloud2> clouds = recorder.clouds();
  ASSERT_GT(clouds.size(), 10U);
  EXPECT_GE(clouds.front().header.stamp, ros::Time(5000));
  // The connections for clouds and for tf are made, and end, one after the other.
  int num_transformable = 0;
  for (const sensor_msgs::PointCloud2& cloud : clouds) {
    const double periods = (cloud.header.stamp - clouds.front().header.stamp).toSec() * 10.0;
    EXPECT_NEAR(periods, std::round(periods), 1e-6);
    num_transformable +=
        recorder.transforms().canTransform("map", cloud.header.frame_id, cloud.header.stamp) ? 1
                                                                                             : 0;
  }
  EXPECT_GT(num_transformable, 10);
}

nav_msgs::Path makePath(const std::string& frame,
                        const std::vector<std::pair<double, double>>& waypoints) {
  nav_msgs::Path path;
  path.header.frame_id = frame;
  for (const auto& [x, y] : waypoints) {
    path.poses.emplace_back();
    path.poses.back().pose.position.x = x;
    path.poses.back().pose.position.y = y;
  }
  return path;
}

/// Where the robot is after 8 s at 2 m/s with this path.
geometry_msgs::Vector3 driveAlong(const nav_msgs::Path& path, const std::string& name) {
  Recorder recorder;
  ros::NodeHandle node;
  const ros::Publisher publisher = node.advertise<nav_msgs::Path>("path", 1, true);
  publisher.publish(path);
  const ProgramEnd end = runProgram({SIMULATED_LIDAR_PROGRAM, "__name:=" + name, "_duration:=8",
                                     "_publish_clock:=true", "_rate:=4", "_rings:=2",
                                     "_columns:=10", "_follow_path:=true", "_speed:=2"});
  EXPECT_EQ(end.status, 0) << end.err;
  return recorder.transforms()
      .lookupTransform("map", "base_link", ros::Time())
      .transform.translation;
}

TEST(SimulatedLidarNode, followsAPath) {
  const auto place = driveAlong(makePath("map", {{11.0, 6.0}, {11.0, 6.5}}), "lidar_on_a_path");
  EXPECT_DOUBLE_EQ(place.x, 11.0);
  EXPECT_DOUBLE_EQ(place.y, 6.5);
}

TEST(SimulatedLidarNode, staysWhereItIsWithoutAPathInTheMap) {
  const auto place = driveAlong(makePath("odom", {{11.0, 6.5}}), "lidar_without_a_path");
  EXPECT_NEAR(place.x, 10.0, 0.1);
  EXPECT_NEAR(place.y, 6.03, 1e-9);
}

TEST(SimulatedLidarNode, namesEveryBadParameterAndEnds) {
  const ProgramEnd end =
      runProgram({SIMULATED_LIDAR_PROGRAM, "__name:=bad_lidar", "_rings:=0", "_columns:=1.5",
                  "_noise:=much", "_cloud_rate:=-1", "_publish_clock:=3", "_rate:=0", "_seed:=-4",
                  "_ringz:=16", "_door:=ajar"});
  EXPECT_EQ(end.status, 1);
  for (const char* message :
       {"~rings = 0: must be from 1 to 1024", "~columns = 1.5: must be a whole number",
        "~noise = much: must be a number", "~cloud_rate = -1: must be from",
        "~publish_clock = 3: must be true or false", "~rate = 0", "~seed = -4: must be 0 or more",
        "~door = ajar: must be moves, open or closed", "~ringz: there is no such parameter"}) {
    EXPECT_NE(end.err.find(message), std::string::npos) << message << '\n' << end.err;
  }
}

TEST(SimulatedLidarNode, refusesARateWithoutItsClock) {
  const ProgramEnd end =
      runProgram({SIMULATED_LIDAR_PROGRAM, "__name:=fast_lidar", "_rate:=2", "_duration:=1"});
  EXPECT_EQ(end.status, 1);
  EXPECT_NE(end.err.find("~rate: needs publish_clock"), std::string::npos) << end.err;
}

TEST(SimulatedLidarNode, refusesASpeedOnItsOwnWay) {
  const ProgramEnd end =
      runProgram({SIMULATED_LIDAR_PROGRAM, "__name:=hasty_lidar", "_speed:=2", "_duration:=1"});
  EXPECT_EQ(end.status, 1);
  EXPECT_NE(end.err.find("~speed: needs follow_path"), std::string::npos) << end.err;
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
