// SPDX-License-Identifier: BSD-3-Clause
// The running node: maps and calls that octomap_server's topics and services cannot answer.
#include "ros/logged_lines.h"
#include "ros/octomap_server/octomap_probe.h"

#include "cuboid_mapping/SetBox.h"
#include "cuboid_mapping/ros/conversions/points.h"

#include <dynamic_reconfigure/Reconfigure.h>
#include <nav_msgs/OccupancyGrid.h>
#include <sensor_msgs/PointCloud2.h>
#include <visualization_msgs/MarkerArray.h>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

namespace cuboid_mapping_ros::test {
namespace {

class OctomapFaultsTest : public NodeTest {
 protected:
  /// Makes a voxel occupied, however far away.
  static bool setVoxel(double x, double y) {
    cuboid_mapping::SetBox service;
    service.request.boxes.emplace_back();
    service.request.boxes.back().min = toPoint({x, y, 0.0});
    service.request.boxes.back().max =
        toPoint({x + kResolution_m, y + kResolution_m, kResolution_m});
    service.request.occupancy = cuboid_mapping::SetBox::Request::OCCUPIED;
    return callService(std::string(kNode) + "/set_box", service) &&
           service.response.info.success != 0;
  }

  /// Sets the size of projected_map; 1e4 m are more cells than it may have.
  static bool setProjectedSize(double size_m) {
    dynamic_reconfigure::Reconfigure change;
    for (const char* name : {"min_x_size", "min_y_size"}) {
      change.request.config.doubles.emplace_back();
      change.request.config.doubles.back().name = name;
      change.request.config.doubles.back().value = size_m;
    }
    return callService(std::string(kNode) + "/set_parameters", change);
  }
};

TEST_F(OctomapFaultsTest, AMapTooWideForATopicStopsNoOther) {
  ASSERT_TRUE(setVoxel(1e6, 1e6));
  ASSERT_TRUE(setVoxel(-1e6, -1e6));
  int num_markers = 0;
  const boost::function<void(const visualization_msgs::MarkerArray::ConstPtr&)> count =
      [&](const visualization_msgs::MarkerArray::ConstPtr& /*markers*/) { ++num_markers; };
  const boost::function<void(const nav_msgs::OccupancyGrid::ConstPtr&)> ignore =
      [](const nav_msgs::OccupancyGrid::ConstPtr& /*grid*/) {};
  // The first message is made when a subscriber connects, later ones by the timer.
  const ros::Subscriber projected = nh_.subscribe("projected_map", 1, ignore);
  const ros::Subscriber markers = nh_.subscribe("occupied_cuboids", 10, count);
  ASSERT_TRUE(waitFor([&] { return projected.getNumPublishers() > 0 && num_markers > 0; }));
  for (int i = 1; i <= 3; ++i) {
    num_markers = 0;
    cloud_publisher_.publish(makeCloud("map", ros::Time(100.0 + i), {{1.0, 0.0, 0.0}}));
    ASSERT_TRUE(waitForInserted(i));
    ASSERT_TRUE(setVoxel(10.0 * i, 0.0));
    EXPECT_TRUE(waitFor([&] { return num_markers > 0; })) << "markers go on";
  }
  reset();
}

TEST_F(OctomapFaultsTest, ATopicThatFailsIsTriedAgainAndNoOther) {
  ASSERT_TRUE(setProjectedSize(1e4));
  TopicProbe<nav_msgs::OccupancyGrid> projected("projected_map");
  TopicProbe<sensor_msgs::PointCloud2> centers("octomap_point_cloud_centers");
  ASSERT_TRUE(projected.waitForConnection());
  ASSERT_TRUE(setVoxel(10.0, 0.0));
  ASSERT_TRUE(centers.waitForMessage([](const auto& cloud) { return cloud.width == 1; }));
  ASSERT_TRUE(diagnostics_.waitForNextReport());
  const int num_centers = centers.count();
  const int num_projected = projected.count();
  const long num_failed = countNew("callbacks failed");
  EXPECT_TRUE(waitFor([&] { return countNew("callbacks failed") >= num_failed + 3; }));
  EXPECT_EQ(centers.count(), num_centers) << "nothing has changed";
  EXPECT_EQ(projected.count(), num_projected);
  ASSERT_TRUE(setProjectedSize(0.0));
  reset();
  EXPECT_TRUE(waitFor([&] { return projected.count() > num_projected; })) << "it fits again";
}

TEST_F(OctomapFaultsTest, AServiceThatThrowsTellsTheCallerWhy) {
  octomap_msgs::BoundingBoxQuery service;
  service.request.min.x = 1.0;
  service.request.max.x = std::numeric_limits<double>::quiet_NaN();
  (void)LoggedLines::take();
  EXPECT_FALSE(ros::service::call(std::string(kNode) + "/clear_bbx", service));
  // Only roscpp's log has the service's text.
  const std::vector<std::string> lines = LoggedLines::take();
  EXPECT_TRUE(std::any_of(lines.begin(), lines.end(), [](const std::string& line) {
    return line.find("corners must be finite") != std::string::npos;
  }));
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
