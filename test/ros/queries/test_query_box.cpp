// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/queries/answers.h"

#include "cuboid_mapping/ros/conversions/points.h"
#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/scan/scan_update.h"

#include <geometry_msgs/TransformStamped.h>
#include <gtest/gtest.h>
#include <tf2/buffer_core.h>
#include <tf2_eigen/tf2_eigen.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <string>
#include <thread>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::MapConfig;
using Point = geometry_msgs::Point;
using Request = cuboid_mapping::QueryBox::Request;
using Response = cuboid_mapping::QueryBox::Response;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double Point::*kAxes[] = {&Point::x, &Point::y, &Point::z};

/// A beam along x from (0.05, 0.05, 0.05), which ends in the voxel [1, 1.1) at 0.1 m: ten free
/// voxels and an occupied one, seen twice.
class QueryBoxTest : public ::testing::Test {
 protected:
  QueryBoxTest() : map_(makeConfig()) {
    cuboid_mapping::Scan scan;
    scan.origin = {0.05F, 0.05F, 0.05F};
    scan.points = {{1.05F, 0.05F, 0.05F}};
    cuboid_mapping::ScanUpdater updater(map_.grid());
    const cuboid_mapping::ScanUpdate& update = updater.compute(scan);
    for (int i = 0; i < 2; ++i) {
      map_.change(ros::Time(i + 1.0),
                  [&update](cuboid_mapping::CuboidMap& map) { return map.apply(update); });
    }
  }

  static MapConfig makeConfig() {
    MapConfig config;
    config.resolution_m = 0.1;
    return config;
  }

  void setTransform(const std::string& child, const Eigen::Isometry3d& T_map_child, double stamp) {
    geometry_msgs::TransformStamped transform = tf2::eigenToTransform(T_map_child);
    transform.header.frame_id = "map";
    transform.header.stamp = ros::Time(stamp);
    transform.child_frame_id = child;
    ASSERT_TRUE(tf_.setTransform(transform, "test"));
  }

  Response ask(const Request& request) {
    return answer<cuboid_mapping::QueryBox>({map_, "map", tf_}, request);
  }

  void expectError(const Request& request, const std::string& part) {
    const Response answer = ask(request);
    EXPECT_FALSE(answer.success);
    EXPECT_NE(answer.message.find(part), std::string::npos)
        << "answered: '" << answer.message << "'";
  }

  static Request makeRequest(const Eigen::Vector3d& min = {0.9, 0.0, 0.0},
                             const Eigen::Vector3d& max = {1.2, 0.1, 0.1}) {
    Request request;
    request.min = toPoint(min);
    request.max = toPoint(max);
    return request;
  }

  GuardedMap map_;
  tf2::BufferCore tf_;
};

TEST_F(QueryBoxTest, AnswersWithVolumesAndCuboids) {
  Request request = makeRequest();
  request.cuboids = Request::CUBOIDS_ALL;
  const Response answer = ask(request);
  EXPECT_TRUE(answer.success) << answer.message;
  EXPECT_FALSE(answer.truncated);
  EXPECT_EQ(answer.revision, 2U);
  EXPECT_EQ(answer.header.stamp, ros::Time(2.0));
  EXPECT_EQ(answer.header.frame_id, "map");
  EXPECT_NEAR(answer.free_volume, 0.001, 1e-12);
  EXPECT_NEAR(answer.occupied_volume, 0.001, 1e-12);
  EXPECT_NEAR(answer.unknown_volume, 0.001, 1e-12);
  EXPECT_EQ(answer.occupancy, Response::OCCUPIED);
  // Two hits of 0.7: odds (7 / 3)^2.
  EXPECT_NEAR(answer.max_probability, 49.0 / 58.0, 1e-5);
  EXPECT_NEAR((toVector(answer.max) - Eigen::Vector3d(1.2, 0.1, 0.1)).norm(), 0.0, 1e-12);
  // The free voxels of the second brick, [0.8, 1) m, and the occupied one.
  ASSERT_EQ(answer.cuboids.size(), 2U);
  for (const cuboid_mapping::MapCuboid& cuboid : answer.cuboids) {
    const bool is_occupied = cuboid.occupancy == Response::OCCUPIED;
    EXPECT_NEAR(cuboid.min.x, is_occupied ? 1.0 : 0.8, 1e-12);
    EXPECT_NEAR(cuboid.max.x, is_occupied ? 1.1 : 1.0, 1e-12);
    EXPECT_NEAR(cuboid.probability, is_occupied ? 49.0 / 58.0 : 4.0 / 13.0, 1e-5);
  }
}

TEST_F(QueryBoxTest, ReturnsTheWantedCuboidsOnly) {
  Request request = makeRequest();
  const auto count = [&](std::uint8_t wanted) {
    request.cuboids = wanted;
    return ask(request).cuboids.size();
  };
  EXPECT_EQ(count(Request::CUBOIDS_NONE), 0U);
  EXPECT_EQ(count(Request::CUBOIDS_FREE), 1U);
  EXPECT_EQ(count(Request::CUBOIDS_OCCUPIED), 1U);
  EXPECT_EQ(count(Request::CUBOIDS_ALL), 2U);

  request.cuboids = Request::CUBOIDS_FREE;
  request.clip = 1;
  EXPECT_NEAR(ask(request).cuboids.front().min.x, 0.9, 1e-12);
}

TEST_F(QueryBoxTest, UnknownSpaceHasNoProbability) {
  const Response answer = ask(makeRequest({5.0, 5.0, 5.0}, {6.0, 6.0, 6.0}));
  EXPECT_TRUE(answer.success) << answer.message;
  EXPECT_EQ(answer.occupancy, Response::UNKNOWN);
  EXPECT_TRUE(std::isnan(answer.max_probability));
  EXPECT_NEAR(answer.unknown_volume, 1.0, 1e-9);
}

TEST_F(QueryBoxTest, TakesBoxesInAnyFrame) {
  // The child's x is the map's y; a box of one voxel stays one voxel.
  Eigen::Isometry3d T_map_child = Eigen::Isometry3d::Identity();
  T_map_child.translate(Eigen::Vector3d(1.0, 2.0, 3.0));
  T_map_child.rotate(Eigen::AngleAxisd(M_PI / 2.0, Eigen::Vector3d::UnitZ()));
  setTransform("child", T_map_child, 5.0);
  Request request = makeRequest({-2.0, -0.1, -3.0}, {-1.9, 0.0, -2.9});
  for (const std::string frame_id : {"child", "/child"}) {
    request.header.frame_id = frame_id;
    const Response answer = ask(request);
    EXPECT_TRUE(answer.success) << answer.message;
    EXPECT_NEAR((toVector(answer.min) - Eigen::Vector3d(1.0, 0.0, 0.0)).norm(), 0.0, 1e-12);
    EXPECT_NEAR((toVector(answer.max) - Eigen::Vector3d(1.1, 0.1, 0.1)).norm(), 0.0, 1e-12);
    EXPECT_NEAR(answer.occupied_volume, 0.001, 1e-12);
    EXPECT_NEAR(answer.unknown_volume, 0.0, 1e-12);
  }
}

TEST_F(QueryBoxTest, TheMapsFrameNeedsNoTf) {
  Request request = makeRequest();
  for (const std::string frame_id : {"", "map", "/map"}) {
    request.header.frame_id = frame_id;
    request.header.stamp = ros::Time(1e6);
    EXPECT_TRUE(ask(request).success);
  }
}

TEST_F(QueryBoxTest, WaitsForATransformThatIsALittleLate) {
  setTransform("child", Eigen::Isometry3d::Identity(), 5.0);
  Request request = makeRequest();
  request.header.frame_id = "child";
  bool is_answered = false;
  for (int i = 1; i <= 10 && !is_answered; ++i) {  // A busy machine may exceed the patience.
    request.header.stamp = ros::Time(5.0 + i);
    std::thread late([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(30));
      setTransform("child", Eigen::Isometry3d::Identity(), 5.0 + i);
    });
    is_answered = ask(request).success != 0;
    late.join();
  }
  EXPECT_TRUE(is_answered);
}

TEST_F(QueryBoxTest, RefusesBadRequestsAndSaysWhatToDo) {
  Request request = makeRequest();
  request.cuboids = 4;
  expectError(request, "CUBOIDS_*");
  for (const double bad : {kNan, -kNan, kInfinity, -kInfinity}) {
    for (const auto axis : kAxes) {
      request = makeRequest();
      request.max.*axis = bad;
      expectError(request, "NaN or infinite");
      EXPECT_EQ(ask(request).message.find("nan"), std::string::npos) << ask(request).message;
      request = makeRequest();
      request.min.*axis = bad;
      expectError(request, "NaN or infinite");
    }
  }
  for (const auto axis : kAxes) {
    request = makeRequest();
    request.min.*axis = request.max.*axis;
    expectError(request, "min must be less than max");
    request.min.*axis += 1.0;
    expectError(request, "min must be less than max");
  }
  request = makeRequest();
  request.max.x = 1e300;
  expectError(request, "reaches beyond the map: keep coordinates within 107374176 m of the origin");
  request = makeRequest();
  request.header.frame_id = "nowhere";
  expectError(request, "no transform from frame 'nowhere' to 'map'");
  setTransform("child", Eigen::Isometry3d::Identity(), 5.0);
  request.header.frame_id = "child";
  request.header.stamp = ros::Time(7.0);
  expectError(request, "with stamp 0, the latest");
}

}  // namespace
}  // namespace cuboid_mapping_ros
