// SPDX-License-Identifier: BSD-3-Clause
// Node and nodelet on bags played by `rosbag play --clock`: from the simulated building, and from real
// scans if CUBOID_DATA_DIR is set.
#include "cuboid_mapping/QueryBox.h"
#include "cuboid_mapping/SaveMap.h"
#include "ros/node_probe.h"
#include "tools/read_bag.h"
#include "tools/run_program.h"

#include <visualization_msgs/MarkerArray.h>

#include <cstdlib>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::test::runProgram;
using cuboid_mapping::test::TemporaryFolder;

class ReplayTest : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    std_srvs::Empty empty;
    ASSERT_TRUE(waitFor([this] { return probe_.numReports() > 0; }));
    ASSERT_TRUE(callService(std::string(GetParam()) + "/reset", empty));
    ASSERT_TRUE(probe_.waitForNextReport());
  }

  /// Plays a bag, and waits until all of its clouds are in the map.
  void play(const std::string& bag) {
    const NodeStatus before = probe_.status();
    const auto num_clouds = static_cast<long>(readBag(bag).clouds.size());
    ASSERT_GT(num_clouds, 5);
    ASSERT_EQ(runProgram({"rosbag", "play", "--quiet", "--clock", "--delay=2", bag}).status, 0);
    EXPECT_TRUE(waitFor([&] {
      return probe_.status().number("clouds inserted") ==
             before.number("clouds inserted") + num_clouds;
    })) << probe_.status().message;
    EXPECT_EQ(probe_.status().number("clouds dropped"), before.number("clouds dropped"));
  }

  /// The class of the voxel that holds a point of the map.
  std::uint8_t classAt(const Eigen::Vector3d& point_map) {
    cuboid_mapping::QueryBox query;
    const Eigen::Vector3d half = Eigen::Vector3d::Constant(1e-4);
    query.request.min = tf2::toMsg(Eigen::Vector3d(point_map - half));
    query.request.max = tf2::toMsg(Eigen::Vector3d(point_map + half));
    if (!query_box_.isValid()) {
      query_box_ =
          nh_.serviceClient<cuboid_mapping::QueryBox>(std::string(GetParam()) + "/query_box", true);
    }
    EXPECT_TRUE(query_box_.call(query));
    EXPECT_TRUE(query.response.success) << query.response.message;
    EXPECT_NEAR(
        query.response.free_volume + query.response.occupied_volume + query.response.unknown_volume,
        (query.response.max.x - query.response.min.x) *
            (query.response.max.y - query.response.min.y) *
            (query.response.max.z - query.response.min.z),
        1e-9);
    return query.response.occupancy;
  }

  /// Expects the points of a bag's last cloud to be occupied, and the space before them to be free.
  void expectLastCloudInMap(const std::string& bag) {
    using Response = cuboid_mapping::QueryBox::Response;
    const BagContents::Cloud last = readBag(bag).clouds.back();
    const Eigen::Isometry3d T_map_cloud = tf2::transformToEigen(last.T_map_cloud);
    std::vector<Eigen::Vector3d> points;
    for (sensor_msgs::PointCloud2ConstIterator<float> p(last.message, "x"); p != p.end(); ++p) {
      const Eigen::Vector3d point(p[0], p[1], p[2]);
      if (point.allFinite() && point.norm() > 2.0 && point.norm() < 15.0) points.push_back(point);
    }
    ASSERT_GT(points.size(), 400U);
    int num_asked = 0;
    int num_occupied = 0;
    int num_free = 0;
    for (std::size_t i = 0; i < points.size(); i += points.size() / 200) {
      ++num_asked;
      num_occupied += classAt(T_map_cloud * points[i]) == Response::OCCUPIED ? 1 : 0;
      num_free += classAt(T_map_cloud * (0.5 * points[i])) == Response::FREE ? 1 : 0;
    }
    EXPECT_GE(num_asked, 200);
    // Not all: beams at a flat angle free voxels that others hit, and a person may have walked by.
    EXPECT_GT(num_occupied, 0.85 * num_asked);
    EXPECT_GT(num_free, 0.8 * num_asked);
  }

  /// Expects that the node saves the same bytes as bag_to_map.
  void expectSameMapAsBagToMap(const std::string& bag, const TemporaryFolder& folder) {
    cuboid_mapping::SaveMap save;
    save.request.filename = folder / "node.cuboids";
    ASSERT_TRUE(callService(std::string(GetParam()) + "/save_map", save));
    ASSERT_TRUE(save.response.info.success) << save.response.info.message;
    const std::string offline = folder / "offline.cuboids";
    ASSERT_EQ(
        runProgram({BAG_TO_MAP_PROGRAM, bag, "-o", offline, "--set", "resolution=0.2"}).status, 0);
    EXPECT_GT(std::filesystem::file_size(offline), 1000U);
    EXPECT_TRUE(cuboid_mapping::test::readText(offline) ==
                cuboid_mapping::test::readText(save.request.filename));
  }

  ros::NodeHandle nh_;
  DiagnosticsProbe probe_{GetParam()};
  /// Persistent, because with hundreds of single connections an answer is sometimes lost.
  ros::ServiceClient query_box_;
};

TEST_P(ReplayTest, TheSimulatedBuildingIsMapped) {
  const TemporaryFolder folder;
  const std::string bag = folder / "building.bag";
  ASSERT_EQ(runProgram({SIMULATED_LIDAR_PROGRAM, "--bag", bag, "--duration", "5"}).status, 0);
  play(bag);
  expectLastCloudInMap(bag);
  expectSameMapAsBagToMap(bag, folder);
  // The robot has driven to its place: its lidar's voxel is free; no voxel below the ground is.
  const Eigen::Isometry3d T_map_cloud =
      tf2::transformToEigen(readBag(bag).clouds.back().T_map_cloud);
  using Response = cuboid_mapping::QueryBox::Response;
  EXPECT_EQ(classAt(T_map_cloud.translation()), Response::FREE);
  EXPECT_EQ(classAt({T_map_cloud.translation().x(), T_map_cloud.translation().y(), -1.0}),
            Response::UNKNOWN);
}

TEST_P(ReplayTest, RealScansAreMapped) {
  const char* data = std::getenv("CUBOID_DATA_DIR");
  if (data == nullptr) GTEST_SKIP() << "CUBOID_DATA_DIR is not set: no real scans to test with";
  const TemporaryFolder folder;
  const std::string bag = folder / "kitti.bag";
  ASSERT_EQ(runProgram({SCANS_TO_BAG_PROGRAM, std::string(data) + "/kitti_0005_city", bag, "--rate",
                        "1", "--clouds", "8"})
                .status,
            0);
  play(bag);
  expectLastCloudInMap(bag);
}

INSTANTIATE_TEST_SUITE_P(NodeAndNodelet, ReplayTest,
                         ::testing::Values("/cuboid_mapping", "/as_nodelet"));

}  // namespace
}  // namespace cuboid_mapping_ros::test
