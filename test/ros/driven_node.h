// SPDX-License-Identifier: BSD-3-Clause
// A running node whose robot drives along x.
#pragma once

#include "cuboid_mapping/SaveMap.h"
#include "cuboid_mapping/SetBox.h"
#include "cuboid_mapping/io/map_files.h"
#include "ros/node_command.h"
#include "ros/node_probe.h"
#include "support/snapshots.h"
#include "tools/run_program.h"

#include <tf2_msgs/TFMessage.h>

#include <cmath>
#include <csignal>
#include <map>
#include <memory>

namespace cuboid_mapping_ros::test {

/// A test with node or nodelet. The frame of the robot is `base`, where the lidar is.
class DrivenNode : public ::testing::TestWithParam<bool> {
 protected:
  static constexpr char kName[] = "/explorer";

  /// Starts it with parameters as "_key:=value".
  void start(const std::vector<std::string>& parameters) {
    std::vector<std::string> command = commandOf(GetParam());
    command.insert(command.end(), {std::string("__name:=") + (kName + 1), "__log:=/dev/null",
                                   "_resolution:=0.1", "_queue_size:=1000"});
    command.insert(command.end(), parameters.begin(), parameters.end());
    node_ = std::make_unique<cuboid_mapping::test::Program>(command);
    ASSERT_TRUE(
        waitFor([this] { return clouds_.getNumSubscribers() > 0 && tf_.getNumSubscribers() > 0; }));
    num_sent_ = 0;
  }

  void end(int signal) {
    node_->send(signal);
    const auto end = node_->finish();
    node_.reset();
    EXPECT_TRUE(signal != SIGINT || end.status == 0) << end.out << end.err;
    ASSERT_TRUE(waitFor(
        [this] { return clouds_.getNumSubscribers() == 0 && tf_.getNumSubscribers() == 0; }));
  }

  /// Parameters of the command line stay on the server.
  void SetUp() override { ros::param::del(kName); }

  void TearDown() override {
    if (node_) end(SIGINT);
  }

  /// Publishes the robot's place. @param x  In the frame at the start.
  void publishPose(double x, const ros::Time& stamp) {
    tf2_msgs::TFMessage tf;
    tf.transforms.push_back(
        makeTransform("map", "base", T_map_start_ * makeTranslation(x, 0.0, 0.0), stamp));
    tf_.publish(tf);
  }

  /// Sends clouds of a room around the robot at these places, one after the other.
  void drive(double from_x, double to_x) {
    const double step = to_x > from_x ? 0.5 : -0.5;
    const auto num_steps = static_cast<int>(std::abs(to_x - from_x) / 0.5);
    for (int i = 0; i <= num_steps; ++i) {
      const ros::Time stamp(time_s_ += 0.1);
      publishPose(from_x + i * step, stamp);
      publishRoom(stamp);
      ++num_sent_;
    }
    ASSERT_TRUE(waitFor([this] {
      return diagnostics_.status().number("clouds inserted") == num_sent_;
    })) << diagnostics_.status().message;
  }

  void publishRoom(const ros::Time& stamp) {
    clouds_.publish(makeCloud("base", stamp, makeRoom({1.0, 1.0, 0.5})));
  }

  static void setBox(std::uint8_t occupancy, bool lock, const Eigen::Vector3d& min,
                     const Eigen::Vector3d& max) {
    cuboid_mapping::SetBox set;
    set.request.occupancy = occupancy;
    set.request.lock = static_cast<std::uint8_t>(lock);
    set.request.boxes.emplace_back();
    set.request.boxes.back().min = tf2::toMsg(min);
    set.request.boxes.back().max = tf2::toMsg(max);
    ASSERT_TRUE(callService(std::string(kName) + "/set_box", set));
    ASSERT_TRUE(set.response.info.success) << set.response.info.message;
  }

  /// The log-odds of all voxels, from ~save_map.
  [[nodiscard]] std::map<cuboid_mapping::Cell, float> saveMap() const {
    cuboid_mapping::SaveMap save;
    save.request.filename = folder_ / "saved.cuboids";
    EXPECT_TRUE(callService(std::string(kName) + "/save_map", save));
    EXPECT_TRUE(save.response.info.success) << save.response.info.message;
    return cuboid_mapping::test::voxelsOf(
        cuboid_mapping::readMapFile(save.request.filename).snapshot.bricks);
  }

  /// A number in the next report.
  [[nodiscard]] long figure(const std::string& key) {
    EXPECT_TRUE(diagnostics_.waitForNextReport());
    return diagnostics_.status().number(key);
  }

  cuboid_mapping::test::TemporaryFolder folder_;
  ros::NodeHandle nh_;
  ros::Publisher clouds_ = nh_.advertise<sensor_msgs::PointCloud2>("/cloud_in", 200);
  ros::Publisher tf_ = nh_.advertise<tf2_msgs::TFMessage>("/tf", 200);
  DiagnosticsProbe diagnostics_{kName};
  std::unique_ptr<cuboid_mapping::test::Program> node_;
  double time_s_ = 100.0;
  Eigen::Isometry3d T_map_start_ = Eigen::Isometry3d::Identity();  ///< Changes after a jump.
  long num_sent_ = 0;
};

}  // namespace cuboid_mapping_ros::test
