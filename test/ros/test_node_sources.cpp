// SPDX-License-Identifier: BSD-3-Clause
// A lidar, a planar laser and a depth camera on a driving robot: node and bag_to_map map the same bag.
// Needs the features deskew, forgetting, no_returns.
#include "cuboid_mapping/SaveMap.h"
#include "cuboid_mapping/io/map_files.h"
#include "ros/node_probe.h"
#include "support/random.h"
#include "support/snapshots.h"
#include "tools/run_program.h"

#include <rosbag/bag.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/LaserScan.h>
#include <tf2_msgs/TFMessage.h>

#include <cstring>
#include <limits>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::test::Random;
using cuboid_mapping::test::runProgram;
using cuboid_mapping::test::shareOfSameClasses;
using cuboid_mapping::test::TemporaryFolder;

constexpr double kStart_s = 1000.0;
constexpr double kDuration_s = 4.0;

/// Writes a bag whose messages are recorded some time after their stamps, and tf after them.
class DriveWriter {
 public:
  explicit DriveWriter(const std::string& file) : bag_(file, rosbag::bagmode::Write) {
    writeStaticFrames();
    for (double t = 0.0; t < kDuration_s + 0.5; t += 0.05) writePose(t);
    for (double t = 0.0; t < kDuration_s; t += 0.1) writeCloud(t);
    for (double t = 0.013; t < kDuration_s; t += 0.05) writeScan(t);
    for (double t = 0.007; t < kDuration_s; t += 1.0 / 30.0) writeDepth(t);
  }

 private:
  void writeStaticFrames() {
    tf2_msgs::TFMessage frames;
    const Eigen::Isometry3d T_base_camera =
        Eigen::Translation3d(0.2, 0.0, 0.6) *
        Eigen::Quaterniond(-0.5, 0.5, -0.5, 0.5);  // x right, y down, z forward
    frames.transforms.push_back(makeTransform("base", "lidar", makeTranslation(0.0, 0.0, 1.0)));
    frames.transforms.push_back(makeTransform("base", "laser", makeTranslation(0.3, 0.0, 0.2)));
    frames.transforms.push_back(makeTransform("base", "camera", T_base_camera));
    bag_.write("/tf_static", ros::Time(kStart_s - 0.1), frames);
  }

  void writePose(double t) {
    const Eigen::Isometry3d T_map_base = Eigen::Translation3d(0.5 * t, 0.1 * t, 0.0) *
                                         Eigen::AngleAxisd(0.2 * t, Eigen::Vector3d::UnitZ());
    tf2_msgs::TFMessage pose;
    pose.transforms.push_back(makeTransform("map", "base", T_map_base, ros::Time(kStart_s + t)));
    bag_.write("/tf", ros::Time(kStart_s + t + 0.02), pose);
  }

  /// A header with the stamp of the measurement. @param frame_id  Frame of the sensor.
  static std_msgs::Header makeHeader(const std::string& frame_id, double t) {
    std_msgs::Header header;
    header.frame_id = frame_id;
    header.stamp = ros::Time(kStart_s + t);
    return header;
  }

  template <typename MessageT>
  void write(const std::string& topic, const MessageT& message, double delay_s) {
    bag_.write(topic, message.header.stamp + ros::Duration(delay_s), message);
  }

  /// The cloud with times of points within 80 ms.
  static sensor_msgs::PointCloud2 withTimes(const sensor_msgs::PointCloud2& cloud) {
    sensor_msgs::PointCloud2 timed = cloud;
    sensor_msgs::PointCloud2Modifier modifier(timed);
    modifier.setPointCloud2Fields(
        4, "x", 1, sensor_msgs::PointField::FLOAT32, "y", 1, sensor_msgs::PointField::FLOAT32, "z",
        1, sensor_msgs::PointField::FLOAT32, "time", 1, sensor_msgs::PointField::FLOAT32);
    modifier.resize(cloud.width);
    sensor_msgs::PointCloud2ConstIterator<float> from(cloud, "x");
    sensor_msgs::PointCloud2Iterator<float> to(timed, "x");
    for (std::uint32_t i = 0; i < cloud.width; ++i, ++from, ++to) {
      for (int axis = 0; axis < 3; ++axis) to[axis] = from[axis];
      to[3] = 0.0002F * static_cast<float>(i);
    }
    return timed;
  }

  void writeCloud(double t) {
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < 400; ++i) {
      points.emplace_back(random_.real(-6, 6), random_.real(-6, 6), random_.real(-1, 1));
    }
    // Later than the others' measurements meanwhile.
    write("/front/points", withTimes(makeCloud("lidar", ros::Time(kStart_s + t), points)), 0.08);
  }

  void writeScan(double t) {
    sensor_msgs::LaserScan scan;
    scan.header = makeHeader("laser", t);
    scan.angle_min = -2.0F;
    scan.angle_increment = 0.02F;
    scan.time_increment = 0.0001F;
    scan.range_min = 0.1F;
    scan.range_max = 10.0F;
    for (int i = 0; i < 200; ++i) {
      const float readings[] = {std::numeric_limits<float>::infinity(), 0.0F,
                                std::numeric_limits<float>::quiet_NaN()};
      scan.ranges.push_back(i % 10 == 0 ? readings[random_.index(3)]
                                        : static_cast<float>(random_.real(0.5, 9.0)));
    }
    write("/scan", scan, 0.01);
  }

  void writeDepth(double t) {
    sensor_msgs::Image image;
    image.header = makeHeader("camera", t);
    image.width = 32;
    image.height = 24;
    image.encoding = "32FC1";
    image.step = image.width * 4;
    std::vector<float> depths_m;
    for (int i = 0; i < 32 * 24; ++i)
      depths_m.push_back(static_cast<float>(random_.real(0.5, 4.0)));
    image.data.resize(depths_m.size() * 4);
    std::memcpy(image.data.data(), depths_m.data(), image.data.size());
    sensor_msgs::CameraInfo camera;
    camera.header = image.header;
    camera.P[0] = camera.P[5] = 30.0;
    camera.P[2] = 16.0;
    camera.P[6] = 12.0;
    write("/camera/depth", image, 0.03);
    write("/camera/camera_info", camera, 0.031);
  }

  Random random_;
  rosbag::Bag bag_;
};

class NodeSourcesTest : public ::testing::Test {
 protected:
  [[nodiscard]] std::string mapOfBag(const std::string& bag, const std::string& map) {
    EXPECT_EQ(runProgram({BAG_TO_MAP_PROGRAM, bag, "-o", map, "--params",
                          std::string(CUBOID_MAPPING_SOURCE_DIR) + "/test/ros/sources.yaml"})
                  .status,
              0);
    return cuboid_mapping::test::readText(map);
  }

  TemporaryFolder folder_;
  ros::NodeHandle nh_;
  DiagnosticsProbe probe_{kNode};
};

/// bag_to_map takes the clouds by their stamps, the node as they arrive: where log-odds are clamped, or voxels
/// forgotten meanwhile, the order counts.
TEST_F(NodeSourcesTest, NodeAndBagToMapMakeNearlyTheSameMapOfThreeSensors) {
  const std::string bag = folder_ / "drive.bag";
  { const DriveWriter writer(bag); }
  const std::string offline = mapOfBag(bag, folder_ / "offline.cuboids");
  EXPECT_GT(offline.size(), 10000U);
  EXPECT_TRUE(offline == mapOfBag(bag, folder_ / "again.cuboids"));

  ASSERT_TRUE(waitFor([this] { return probe_.numReports() > 0; }));
  ASSERT_EQ(runProgram({"rosbag", "play", "--quiet", "--clock", "--delay=2", bag}).status, 0);
  // 40 clouds, 40 of 80 scans, and all images.
  const long num_expected = 40 + 40 + 120;
  EXPECT_TRUE(waitFor([&] { return probe_.status().number("clouds inserted") == num_expected; }))
      << probe_.status().number("clouds inserted") << ' ' << probe_.status().message;
  EXPECT_EQ(probe_.status().number("clouds dropped"), 0);
  cuboid_mapping::SaveMap save;
  save.request.filename = folder_ / "node.cuboids";
  ASSERT_TRUE(callService(std::string(kNode) + "/save_map", save));
  ASSERT_TRUE(save.response.info.success) << save.response.info.message;
  const double share =
      shareOfSameClasses(cuboid_mapping::readMapFile(folder_ / "offline.cuboids").snapshot,
                         cuboid_mapping::readMapFile(save.request.filename).snapshot);
  EXPECT_GT(share, 0.98);
}

/// Compares the figures of each source with those of the node.
TEST_F(NodeSourcesTest, EachSourceHasItsDiagnostics) {
  std::map<std::string, std::string> received;
  std::string ignored;
  const ros::Subscriber subscriber = nh_.subscribe<diagnostic_msgs::DiagnosticArray>(
      "/diagnostics", 10, [&](const diagnostic_msgs::DiagnosticArray::ConstPtr& array) {
        for (const auto& status : array->status) {
          for (const auto& value : status.values) {
            if (value.key == "messages received") received[status.name] = value.value;
            const bool is_laser = status.name.find("source laser") != std::string::npos;
            if (is_laser && value.key == "messages ignored, max_rate") ignored = value.value;
          }
        }
      });
  EXPECT_TRUE(waitFor([&] { return received.size() == 3 && !ignored.empty(); }));
  const std::map<std::string, std::string> expected{{"cuboid_mapping: source camera", "120"},
                                                    {"cuboid_mapping: source laser", "40"},
                                                    {"cuboid_mapping: source lidar", "40"}};
  EXPECT_EQ(received, expected);
  EXPECT_EQ(ignored, "40");
}

TEST_F(NodeSourcesTest, BagToMapSaysWhichSourcesABagDoesNotHave) {
  const std::string bag = folder_ / "laser.bag";
  const std::string map = folder_ / "laser.cuboids";
  {
    rosbag::Bag out(bag, rosbag::bagmode::Write);
    sensor_msgs::LaserScan scan;
    scan.header.stamp = ros::Time(kStart_s);
    scan.header.frame_id = "map";
    scan.angle_increment = 0.1F;
    scan.time_increment = 0.01F;
    scan.range_max = 10.0F;
    scan.ranges = {1.0F, 2.0F};
    out.write("/scan", scan.header.stamp, scan);
  }
  const std::string parameters = std::string(CUBOID_MAPPING_SOURCE_DIR) + "/test/ros/sources.yaml";
  const auto some = runProgram({BAG_TO_MAP_PROGRAM, bag, "-o", map, "--params", parameters});
  EXPECT_EQ(some.status, 0) << some.err;
  EXPECT_NE(some.err.find("the bags have no topic /front/points"), std::string::npos) << some.err;
  EXPECT_NE(some.err.find("the bags have no topic /camera/depth"), std::string::npos) << some.err;
  const auto alone = runProgram({BAG_TO_MAP_PROGRAM, bag, "-o", map, "--set", "type=laser_scan"});
  EXPECT_EQ(alone.status, 0) << alone.err;
  const auto wrong = runProgram({BAG_TO_MAP_PROGRAM, bag, "-o", map, "--set",
                                 "sources=[{name: a, topic: /scan}, {name: b, topic: /none}]"});
  EXPECT_NE(wrong.status, 0);
  EXPECT_NE(wrong.err.find("source a: /scan has messages of sensor_msgs/LaserScan, not of "
                           "sensor_msgs/PointCloud2"),
            std::string::npos)
      << wrong.err;
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
