// SPDX-License-Identifier: BSD-3-Clause
// Symptoms of doc/troubleshooting.md that need running nodes and their logs, and their cures.
// Needs the features files, ground, no_returns.
#include "ros/log_probe.h"
#include "ros/octomap_server/octomap_probe.h"

#include <dynamic_reconfigure/Reconfigure.h>
#include <sensor_msgs/LaserScan.h>
#include <sensor_msgs/PointCloud.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace cuboid_mapping_ros::test {
namespace {

constexpr char kFarNode[] = "/far/octomap_server";
constexpr char kGroundNode[] = "/ground/octomap_server";

/// queue_size of the nodes.
constexpr int kQueueSize = 5;

void setNumber(const std::string& node, const std::string& name, double value) {
  dynamic_reconfigure::Reconfigure change;
  change.request.config.doubles.resize(1);
  change.request.config.doubles[0].name = name;
  change.request.config.doubles[0].value = value;
  ASSERT_TRUE(ros::service::waitForService(node + "/set_parameters", ros::Duration(kDeadline_s)));
  ASSERT_TRUE(callService(node + "/set_parameters", change));
}

class TroubleshootingTest : public NodeTest {
 protected:
  void SetUp() override {
    NodeTest::SetUp();
    publishStaticTf(makeTransform("map", "lidar", makeTranslation(0.05, 0.05, 0.05)));
  }

  /// Waits until log lines of a node arrive: it refuses another resolution, and logs this every time.
  void listenTo(const std::string& node) {
    ASSERT_TRUE(waitFor([&] {
      setNumber(node, "resolution", 77.0);
      return log_.has("resolution cannot be changed", node);
    }));
  }

  void publishClouds(const ros::Publisher& publisher, const std::string& frame_id,
                     int count) const {
    for (int i = 0; i < count; ++i) {
      publisher.publish(makeCloud(frame_id, ros::Time(100.0), {{1.0, 0.0, 0.0}}));
    }
  }

  LogProbe log_;
};

TEST_F(TroubleshootingTest, NoCloudHasEverCome) {
  DiagnosticsProbe diagnostics(kFarNode);
  ASSERT_TRUE(diagnostics.waitForNextReport());
  EXPECT_EQ(diagnostics.status().level, static_cast<int>(diagnostic_msgs::DiagnosticStatus::WARN));
  EXPECT_EQ(diagnostics.status().message.find("no cloud on /far/cloud_in yet, nobody publishes it"),
            0U)
      << diagnostics.status().message;
}

TEST_F(TroubleshootingTest, ATopicThatNobodyPublishes) {
  const auto publisher = nh_.advertise<sensor_msgs::PointCloud2>("/far/points", 1);
  DiagnosticsProbe diagnostics(kFarNode);
  EXPECT_TRUE(waitFor([&] {
    return diagnostics.status().message.find("/far/points") != std::string::npos;
  })) << diagnostics.status().message;
}

TEST_F(TroubleshootingTest, ATopicOfAnotherType) {
  listenTo(kFarNode);
  DiagnosticsProbe diagnostics(kFarNode);
  const auto expect_error = [&](const std::string& text) {
    EXPECT_TRUE(waitFor([&] {
      return diagnostics.status().level ==
                 static_cast<int>(diagnostic_msgs::DiagnosticStatus::ERROR) &&
             diagnostics.status().message.find(text) != std::string::npos;
    })) << diagnostics.status().message;
    EXPECT_TRUE(log_.waitForLine(text, kFarNode));
  };
  auto publisher = nh_.advertise<sensor_msgs::LaserScan>("/far/cloud_in", 1);
  expect_error(
      "/far/cloud_in has messages of sensor_msgs/LaserScan, not of sensor_msgs/PointCloud2 "
      "(type point_cloud): set type to laser_scan");
  publisher = {};
  auto old_clouds = nh_.advertise<sensor_msgs::PointCloud>("/far/cloud_in", 1);
  expect_error("convert it with point_cloud_converter");
}

TEST_F(TroubleshootingTest, APublisherWithAnotherVersionOfTheMessage) {
  auto options = ros::AdvertiseOptions::create<sensor_msgs::PointCloud2>("/far/cloud_in", 1, {}, {},
                                                                         {}, nullptr);
  options.md5sum = std::string(options.md5sum.size(), '1');
  const ros::Publisher publisher = nh_.advertise(options);
  DiagnosticsProbe diagnostics(kFarNode);
  EXPECT_TRUE(waitFor([&] {
    return diagnostics.status().message.find("though it is published") != std::string::npos;
  })) << diagnostics.status().message;
}

TEST_F(TroubleshootingTest, CloudsWithoutATransform) {
  listenTo(kNode);
  publishClouds(cloud_publisher_, "nowhere", kQueueSize + 1);
  EXPECT_TRUE(log_.waitForLine("wait for tf: waited for", kNode)) << "before it is dropped";
  EXPECT_TRUE(log_.has("the roots of tf's trees are", kNode) ||
              log_.has("tf has no frame at all", kNode));
  EXPECT_TRUE(waitFor([&] { return countNew("clouds dropped, no transform") == kQueueSize + 1; }));
  EXPECT_TRUE(log_.waitForLine("cloud dropped, no transform: frame 'nowhere'", kNode));
  EXPECT_TRUE(log_.has("check that tf has a path from the cloud's frame to frame_id", kNode));
}

TEST_F(TroubleshootingTest, AWarningNamesTheTopicAfterRemapping) {
  listenTo(kNode);
  auto cloud = makeCloud("lidar", ros::Time(100.0), {{1.0, 2.0, 3.0}});
  cloud.is_bigendian = 1;
  cloud_publisher_.publish(cloud);
  EXPECT_TRUE(log_.waitForLine("/cloud_in: is_bigendian is true", kNode));
}

TEST_F(TroubleshootingTest, CloudsOlderThanAllTransforms) {
  listenTo(kNode);
  for (const double stamp : {1015.0, 1018.9, 1019.2, 1020.0}) {
    publishTf(makeTransform("map", "moving", makeTranslation(stamp, 0, 0), ros::Time(stamp)));
  }
  const auto publish_cloud = [this](double stamp) {
    cloud_publisher_.publish(makeCloud("moving", ros::Time(stamp), {{1.0, 0.0, 0.0}}));
  };
  publish_cloud(1019.0);
  ASSERT_TRUE(waitForInserted(1));
  publish_cloud(1005.0);
  EXPECT_TRUE(waitFor([&] { return countNew("clouds dropped, too old for tf") == 1; }));
  EXPECT_TRUE(log_.waitForLine("cloud dropped, too old for tf: frame 'moving'", kNode));
  EXPECT_TRUE(log_.has("with recorded data set use_sim_time", kNode));
}

TEST_F(TroubleshootingTest, TheGroundFilterWithoutItsBase) {
  listenTo(kGroundNode);
  DiagnosticsProbe diagnostics(kGroundNode);
  auto publisher = nh_.advertise<sensor_msgs::PointCloud2>("/ground/cloud_in", 20);
  ASSERT_TRUE(waitFor([&] { return publisher.getNumSubscribers() > 0; }));
  publishClouds(publisher, "lidar", kQueueSize + 1);
  EXPECT_TRUE(log_.waitForLine("wait for tf: waited for", kGroundNode));
  EXPECT_EQ(diagnostics.status().number("clouds inserted"), 0);
  EXPECT_TRUE(log_.has("robot", kGroundNode)) << "names base_frame_id";
  publishStaticTf(makeTransform("map", "robot", makeTranslation(0.0, 0.0, -1.0)));
  EXPECT_TRUE(waitFor([&] {
    return diagnostics.status().number("clouds inserted") == kQueueSize + 1;
  })) << "with the transform, those that wait get in";
}

TEST_F(TroubleshootingTest, AMapThatReachesBeyondTheOctree) {
  listenTo(kFarNode);
  EXPECT_FALSE(callOctomap("/far/octomap_full").data.empty());
  EXPECT_TRUE(log_.waitForLine("an octree reaches 32768 voxels from the origin", kFarNode));
}

TEST_F(TroubleshootingTest, ABoxThatIsClearedTooEarly) {
  const auto count_occupied = [] {
    return countVoxels(contentOf(callOctomap("/octomap_full")), true);
  };
  publishRoom("lidar");
  ASSERT_TRUE(waitForInserted(1));
  const double num_walls = count_occupied();
  octomap_msgs::BoundingBoxQuery clear;
  clear.request.min = tf2::toMsg(Eigen::Vector3d(1.95, -0.45, -0.45));
  clear.request.max = tf2::toMsg(Eigen::Vector3d(2.35, 0.45, 0.45));
  ASSERT_TRUE(callService(std::string(kNode) + "/clear_bbx", clear));
  EXPECT_EQ(count_occupied(), num_walls - 100);
  for (int i = 0; i < 3; ++i) publishRoom("lidar");
  ASSERT_TRUE(waitForInserted(4));
  EXPECT_EQ(count_occupied(), num_walls);
}

/// One turn of a lidar with 16 rings: a round wall at 3 m, and an object at 1.5 m in front of a part of it.
/// @param has_thing  If false, there is no return from its directions, as from the open sky.
sensor_msgs::PointCloud2 makeTurn(bool has_thing) {
  constexpr int kNumColumns = 360;
  std::vector<Eigen::Vector3d> points;
  for (int ring = 0; ring < 16; ++ring) {
    for (int column = 0; column < kNumColumns; ++column) {
      const bool is_thing = column < 20;
      double range_m = is_thing ? 1.5 : 3.0;
      if (is_thing && !has_thing) range_m = std::numeric_limits<double>::quiet_NaN();
      const double azimuth = column * M_PI / 180.0;
      const double elevation = (ring - 8) * M_PI / 180.0;
      points.emplace_back(range_m * std::cos(elevation) * std::cos(azimuth),
                          range_m * std::cos(elevation) * std::sin(azimuth),
                          range_m * std::sin(elevation));
    }
  }
  sensor_msgs::PointCloud2 cloud = makeCloud("lidar", ros::Time(100.0), points);
  cloud.height = 16;
  cloud.width = kNumColumns;
  cloud.row_step = cloud.width * cloud.point_step;
  return cloud;
}

/// Number of occupied voxels at most 2 m from the lidar.
double countNear() {
  double count = 0.0;
  for (const auto& leaf : contentOf(callOctomap("/octomap_full")).leaves) {
    const Eigen::Vector2d corner(leaf.box.min.x, leaf.box.min.y);
    if (leaf.log_odds >= 0.0F && corner.norm() < 20.0) count += leaf.box.numVoxels();
  }
  return count;
}

TEST_F(TroubleshootingTest, ThingsThatHaveGoneWithNothingBehindThem) {
  cloud_publisher_.publish(makeTurn(true));
  ASSERT_TRUE(waitForInserted(1));
  const double num_voxels = countNear();
  EXPECT_GT(num_voxels, 20.0);
  for (int i = 0; i < 5; ++i) cloud_publisher_.publish(makeTurn(false));
  ASSERT_TRUE(waitForInserted(6));
  EXPECT_GT(countNear(), 0.5 * num_voxels) << "what no other beam grazes stays";
  setNumber(kNode, "sensor_model_no_return_range", 5.0);
  for (int i = 0; i < 5; ++i) cloud_publisher_.publish(makeTurn(false));
  ASSERT_TRUE(waitForInserted(11));
  EXPECT_EQ(countNear(), 0.0) << "the cure";
  setNumber(kNode, "sensor_model_no_return_range", 0.0);
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
