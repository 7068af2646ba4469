// SPDX-License-Identifier: BSD-3-Clause
// Two simulated lidars, a planar laser and a depth camera: their points are correct, and node and bag_to_map make the
// same map from them.
// Needs the feature no_returns.
#include "cuboid_mapping/SaveMap.h"
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/ros/conversions/sensor_conversions.h"
#include "ros/node_probe.h"
#include "simulation/world.h"
#include "support/snapshots.h"
#include "tools/run_program.h"

#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::test::readText;
using cuboid_mapping::test::runProgram;
using cuboid_mapping::test::TemporaryFolder;

constexpr int kClouds = 20;
constexpr double kDriveStart_s = 1000.0;

class SimulatedSensorsTest : public ::testing::Test {
 protected:
  void writeBag(const std::vector<std::string>& options) {
    std::vector<std::string> command{SIMULATED_LIDAR_PROGRAM,
                                     "--bag",
                                     bag_,
                                     "--all-sensors",
                                     "--duration",
                                     "2",
                                     "--rings",
                                     "8",
                                     "--columns",
                                     "120"};
    command.insert(command.end(), options.begin(), options.end());
    const auto end = runProgram(command);
    ASSERT_EQ(end.status, 0) << end.err;
  }

  [[nodiscard]] std::string mapOfBag(const std::string& file) const {
    const auto end =
        runProgram({BAG_TO_MAP_PROGRAM, bag_, "-o", file, "--params",
                    std::string(CUBOID_MAPPING_SOURCE_DIR) + "/test/ros/simulated_sensors.yaml"});
    EXPECT_EQ(end.status, 0) << end.err;
    return readText(file);
  }

  TemporaryFolder folder_;
  std::string bag_ = folder_ / "drive.bag";
};

/// Greatest distance of the points of a message from the surfaces of the world.
double maxError(const CloudPoints& cloud, const std::vector<cuboid_mapping::Solid>& solids,
                const Eigen::Isometry3d& T_map_sensor) {
  double error = 0.0;
  for (const Eigen::Vector3f& point : cloud.points) {
    double nearest = 1.0;
    for (const auto& solid : solids) {
      const double distance =
          computeSignedDistance(solid.shape, T_map_sensor * point.cast<double>());
      nearest = std::min(nearest, std::abs(distance));
    }
    error = std::max(error, nearest);
  }
  return error;
}

TEST_F(SimulatedSensorsTest, SeeTheSurfacesOfTheWorld) {
  writeBag({"--noise", "0", "--seed", "4"});
  const cuboid_mapping::World world(4);
  tf2::BufferCore tf(ros::Duration(100.0));
  std::map<std::string, int> counts;
  sensor_msgs::CameraInfo::ConstPtr camera;
  rosbag::Bag bag(bag_);
  rosbag::View view(bag);
  for (const auto& instance : view) {
    if (const auto transforms = instance.instantiate<tf2_msgs::TFMessage>()) {
      for (const auto& transform : transforms->transforms) {
        tf.setTransform(transform, "bag", instance.getTopic() == "/tf_static");
      }
    }
    if (const auto info = instance.instantiate<sensor_msgs::CameraInfo>()) camera = info;
  }
  ASSERT_TRUE(camera);
  for (const auto& instance : view) {
    std::optional<std::variant<CloudPoints, CloudError>> converted;
    std_msgs::Header header;
    if (const auto scan = instance.instantiate<sensor_msgs::LaserScan>()) {
      header = scan->header;
      converted = convertLaserScan(*scan);
    } else if (const auto image = instance.instantiate<sensor_msgs::Image>()) {
      header = image->header;
      converted = convertDepthImage({image, camera});
    } else if (const auto cloud = instance.instantiate<sensor_msgs::PointCloud2>()) {
      header = cloud->header;
      converted = convertCloud(*cloud);
    }
    if (!converted) continue;
    ASSERT_TRUE(std::holds_alternative<CloudPoints>(*converted)) << instance.getTopic();
    const auto& points = std::get<CloudPoints>(*converted);
    EXPECT_GT(points.points.size(), 100U) << instance.getTopic();
    const Eigen::Isometry3d T_map_sensor =
        tf2::transformToEigen(tf.lookupTransform("map", header.frame_id, header.stamp));
    const auto solids = world.computeSolids(header.stamp.toSec() - kDriveStart_s);
    // A depth is rounded to millimetres, and the beam is longer than the depth.
    EXPECT_LT(maxError(points, solids, T_map_sensor), 1.2e-3) << instance.getTopic();
    ++counts[instance.getTopic()];
  }
  const std::map<std::string, int> expected{{"/cloud", kClouds},
                                            {"/rear/cloud", kClouds},
                                            {"/scan", 2 * kClouds},
                                            {"/camera/depth/image_rect_raw", 3 * kClouds}};
  EXPECT_EQ(counts, expected);
}

TEST_F(SimulatedSensorsTest, NodeAndBagToMapMakeNearlyTheSameMapOfFour) {
  DiagnosticsProbe probe(kNode);
  writeBag({});
  const std::string offline = mapOfBag(folder_ / "offline.cuboids");
  EXPECT_GT(offline.size(), 10000U);
  EXPECT_TRUE(offline == mapOfBag(folder_ / "again.cuboids"));
  ASSERT_TRUE(waitFor([&] { return probe.numReports() > 0; }));
  ASSERT_EQ(runProgram({"rosbag", "play", "--quiet", "--clock", "--delay=2", bag_}).status, 0);
  EXPECT_TRUE(waitFor([&] { return probe.status().number("clouds inserted") == 7 * kClouds; }))
      << probe.status().number("clouds inserted") << ' ' << probe.status().message;
  EXPECT_EQ(probe.status().number("clouds dropped"), 0);
  cuboid_mapping::SaveMap save;
  save.request.filename = folder_ / "node.cuboids";
  ASSERT_TRUE(callService(std::string(kNode) + "/save_map", save));
  ASSERT_TRUE(save.response.info.success) << save.response.info.message;
  // The node takes clouds as they arrive: where log-odds are clamped, the order counts.
  EXPECT_GT(cuboid_mapping::test::shareOfSameClasses(
                cuboid_mapping::readMapFile(folder_ / "offline.cuboids").snapshot,
                cuboid_mapping::readMapFile(save.request.filename).snapshot),
            0.98);
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
