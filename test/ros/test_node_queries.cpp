// SPDX-License-Identifier: BSD-3-Clause
// The running node: box queries in a known room.
#include "cuboid_mapping/QueryBox.h"
#include "ros/node_probe.h"

#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::QueryBox;

QueryBox::Request makeRequest(const Eigen::Vector3d& min_m, const Eigen::Vector3d& max_m) {
  QueryBox::Request request;
  request.min.x = min_m.x();
  request.min.y = min_m.y();
  request.min.z = min_m.z();
  request.max.x = max_m.x();
  request.max.y = max_m.y();
  request.max.z = max_m.z();
  return request;
}

QueryBox::Response ask(const QueryBox::Request& request, const std::string& node = kNode) {
  QueryBox query;
  query.request = request;
  EXPECT_TRUE(callService(node + "/query_box", query));
  return query.response;
}

void expectRefusal(const QueryBox::Request& request, const std::string& part) {
  const QueryBox::Response response = ask(request);
  EXPECT_FALSE(response.success);
  EXPECT_NE(response.message.find(part), std::string::npos) << response.message;
}

/// A room of 4 x 4 x 2 m around the origin of the map, its walls one voxel thick, seen once.
class NodeQueriesTest : public NodeTest {
 protected:
  void SetUp() override {
    NodeTest::SetUp();
    // The sensor stands in the middle of a voxel.
    const Eigen::Vector3d origin_map(0.05, 0.05, 0.05);
    publishStaticTf(makeTransform("map", "lidar", makeTranslation(0.05, 0.05, 0.05)));
    std::vector<Eigen::Vector3d> points = makeRoom({2.0, 2.0, 1.0});
    for (Eigen::Vector3d& point : points) point -= origin_map;
    cloud_publisher_.publish(makeCloud("lidar", ros::Time(101.5), points));
    ASSERT_TRUE(waitForInserted(1));
  }
};

TEST_F(NodeQueriesTest, TheRoomIsFree) {
  const QueryBox::Response response = ask(makeRequest({-1.9, -1.9, -0.9}, {1.9, 1.9, 0.9}));
  EXPECT_TRUE(response.success) << response.message;
  EXPECT_EQ(response.message, "");
  EXPECT_EQ(response.header.frame_id, "map");
  EXPECT_EQ(response.header.stamp, ros::Time(101.5));
  EXPECT_GT(response.revision, 0U);
  EXPECT_EQ(response.occupancy, static_cast<int>(QueryBox::Response::FREE));
  EXPECT_NEAR(response.free_volume, 3.8 * 3.8 * 1.8, 1e-6);
  EXPECT_NEAR(response.occupied_volume, 0.0, 1e-9);
  EXPECT_NEAR(response.unknown_volume, 0.0, 1e-6);
  EXPECT_NEAR(response.max_probability, 0.4, 1e-5);
  EXPECT_NEAR(response.min.x, -1.9, 1e-9);
  EXPECT_NEAR(response.max.z, 0.9, 1e-9);
  EXPECT_TRUE(response.cuboids.empty());
}

TEST_F(NodeQueriesTest, TheWallIsOccupiedAndWhatIsBehindItUnknown) {
  QueryBox::Request request = makeRequest({1.9, -0.5, -0.5}, {2.3, 0.5, 0.5});
  QueryBox::Response response = ask(request);
  EXPECT_TRUE(response.success) << response.message;
  EXPECT_EQ(response.occupancy, static_cast<int>(QueryBox::Response::OCCUPIED));
  EXPECT_NEAR(response.free_volume, 0.1, 1e-9);
  EXPECT_NEAR(response.occupied_volume, 0.1, 1e-9);
  EXPECT_NEAR(response.unknown_volume, 0.2, 1e-9);
  EXPECT_NEAR(response.max_probability, 0.7, 1e-5);

  request.cuboids = QueryBox::Request::CUBOIDS_OCCUPIED;
  request.clip = 1;
  response = ask(request);
  double volume_m3 = 0.0;
  ASSERT_FALSE(response.cuboids.empty());
  for (const cuboid_mapping::MapCuboid& cuboid : response.cuboids) {
    EXPECT_EQ(cuboid.occupancy, static_cast<int>(cuboid_mapping::MapCuboid::OCCUPIED));
    EXPECT_NEAR(cuboid.probability, 0.7, 1e-5);
    EXPECT_NEAR(cuboid.min.x, 2.0, 1e-9);
    EXPECT_NEAR(cuboid.max.x, 2.1, 1e-9);
    volume_m3 += (cuboid.max.x - cuboid.min.x) * (cuboid.max.y - cuboid.min.y) *
                 (cuboid.max.z - cuboid.min.z);
  }
  EXPECT_NEAR(volume_m3, 0.1, 1e-9);

  response = ask(makeRequest({2.2, -0.5, -0.5}, {3.0, 0.5, 0.5}));
  EXPECT_TRUE(response.success);
  EXPECT_EQ(response.occupancy, static_cast<int>(QueryBox::Response::UNKNOWN));
  EXPECT_TRUE(std::isnan(response.max_probability));
}

TEST_F(NodeQueriesTest, BoxesCanBeGivenInATurnedFrame) {
  // The frame is rotated by 45 degrees: a box of 1 x 1 m there needs one of sqrt(2) x sqrt(2) m here.
  Eigen::Isometry3d T_map_turned = makeTranslation(0.5, 0.25, 0.0);
  T_map_turned.rotate(Eigen::AngleAxisd(M_PI / 4.0, Eigen::Vector3d::UnitZ()));
  publishStaticTf(makeTransform("map", "turned", T_map_turned));
  QueryBox::Request request = makeRequest({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5});
  request.header.frame_id = "turned";
  QueryBox::Response response;
  ASSERT_TRUE(waitFor([&] {
    response = ask(request);
    return response.success != 0;
  })) << response.message;
  EXPECT_EQ(response.header.frame_id, "map");
  // The box [0.5 - 0.707, 0.5 + 0.707] and [0.25 - 0.707, 0.25 + 0.707], rounded to whole voxels.
  EXPECT_NEAR(response.min.x, -0.3, 1e-9);
  EXPECT_NEAR(response.max.x, 1.3, 1e-9);
  EXPECT_NEAR(response.min.y, -0.5, 1e-9);
  EXPECT_NEAR(response.max.y, 1.0, 1e-9);
  EXPECT_NEAR(response.min.z, -0.5, 1e-9);
  EXPECT_NEAR(response.free_volume, 1.6 * 1.5 * 1.0, 1e-6);
}

TEST_F(NodeQueriesTest, BadRequestsAreAnsweredWithWhatToDo) {
  const QueryBox::Request good = makeRequest({0, 0, 0}, {1, 1, 1});
  QueryBox::Request request = good;
  request.min.x = 2.0;
  expectRefusal(request, "min must be less than max");
  request = good;
  request.max.z = 0.0;
  expectRefusal(request, "min must be less than max");
  request = good;
  request.min.y = std::numeric_limits<double>::quiet_NaN();
  expectRefusal(request, "NaN");
  request = good;
  request.max.x = 1e12;
  expectRefusal(request, "reaches beyond the map");
  request = good;
  request.cuboids = 77;
  expectRefusal(request, "CUBOIDS_*");
  request = good;
  request.header.frame_id = "nowhere";
  expectRefusal(request, "no transform from frame 'nowhere'");
  EXPECT_TRUE(ask(good).success) << "and the node lives on";
}

TEST_F(NodeQueriesTest, AfterAResetEverythingIsUnknown) {
  const QueryBox::Request request = makeRequest({-1, -1, -1}, {1, 1, 1});
  const std::uint64_t revision = ask(request).revision;
  reset();
  const QueryBox::Response response = ask(request);
  EXPECT_TRUE(response.success);
  EXPECT_EQ(response.occupancy, static_cast<int>(QueryBox::Response::UNKNOWN));
  EXPECT_NEAR(response.unknown_volume, 8.0, 1e-9);
  EXPECT_GT(response.revision, revision);
  EXPECT_EQ(response.header.stamp, ros::Time());
}

TEST(NodeWithSensorFrame, BeamsStartAtTheSensorThoughTheCloudIsInAnotherFrame) {
  const std::string node = "/with_sensor_frame";
  DiagnosticsProbe diagnostics(node);
  ros::NodeHandle nh;
  auto publisher = nh.advertise<sensor_msgs::PointCloud2>("/transformed_cloud", 10);
  ASSERT_TRUE(waitFor([&] { return publisher.getNumSubscribers() > 0; }));
  // A driver has transformed the cloud into a frame far from the sensor.
  publishStaticTf(makeTransform("map", "lidar", makeTranslation(0.05, 0.05, 0.05)));
  publishStaticTf(makeTransform("map", "far", makeTranslation(-5.0, 0.0, 0.0)));
  ASSERT_TRUE(diagnostics.waitForNextReport());
  const long num_before = diagnostics.status().number("clouds inserted");
  publisher.publish(makeCloud("far", ros::Time(100.0), {{6.05, 0.05, 0.05}}));
  ASSERT_TRUE(
      waitFor([&] { return diagnostics.status().number("clouds inserted") == num_before + 1; }));

  QueryBox::Response response = ask(makeRequest({0.0, 0.0, 0.0}, {1.1, 0.1, 0.1}), node);
  EXPECT_NEAR(response.free_volume, 0.010, 1e-9);
  EXPECT_NEAR(response.occupied_volume, 0.001, 1e-9);
  response = ask(makeRequest({-6.0, -1.0, -1.0}, {0.0, 1.0, 1.0}), node);
  EXPECT_EQ(response.occupancy, static_cast<int>(QueryBox::Response::UNKNOWN));
  EXPECT_NEAR(response.free_volume, 0.0, 1e-9);
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
