// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/planning/planner_services.h"

#include "ros/map_in_frame.h"

#include <cmath>
#include <limits>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::CheckPoses;

class PoseAnswers : public test::MapInFrameTest {
 protected:
  static geometry_msgs::Pose yawed(double x, double y, double yaw) {
    geometry_msgs::Pose pose;
    pose.position = point(x, y, 0.5);
    pose.orientation.z = std::sin(0.5 * yaw);
    pose.orientation.w = std::cos(0.5 * yaw);
    return pose;
  }
  /// A base of 0.5 x 0.2 m in the door: along it, across it, and slightly rotated.
  static CheckPoses::Request makeRequest() {
    CheckPoses::Request request;
    request.poses = {yawed(1.05, 0.45, 0.0), yawed(1.05, 0.45, M_PI / 2), yawed(1.05, 0.45, 0.1)};
    request.boxes.resize(1);
    request.sizes = {vector(0.5, 0.2, 0.2)};
    return request;
  }
};

TEST_F(PoseAnswers, TellForEachPoseWhatABodyMeets) {
  const auto response = answer<CheckPoses>(in_frame_, makeRequest());
  expectHead(response);
  EXPECT_EQ(response.free, (std::vector<std::uint8_t>{1, 0, 1}));
  EXPECT_EQ(response.part, (std::vector<std::int32_t>{-1, 0, -1}));
  EXPECT_EQ(response.occupancy,
            (std::vector<std::uint8_t>{CheckPoses::Response::FREE, CheckPoses::Response::OCCUPIED,
                                       CheckPoses::Response::FREE}));
  expectNear(response.point[1], 1.05, 0.25, 0.45);
  EXPECT_EQ(response.info.answered, 3U);
  EXPECT_FALSE(response.info.enclosing);
}

TEST_F(PoseAnswers, TakeSpheresInflationAndUnknownSpaceIntoAccount) {
  CheckPoses::Request request;
  request.poses = {yawed(1.05, 0.45, 0.0)};
  request.spheres = {point(0, 0, 0), point(0, 0, 0.4)};
  request.radii = {0.14, 0.14};
  auto response = answer<CheckPoses>(in_frame_, request);
  EXPECT_EQ(response.part[0], 1) << "it reaches out of the room";
  EXPECT_EQ(response.occupancy[0], CheckPoses::Response::UNKNOWN);
  request.unknown = CheckPoses::Request::UNKNOWN_FREE;
  EXPECT_TRUE(answer<CheckPoses>(in_frame_, request).free[0]);
  request.inflation = 0.02;
  response = answer<CheckPoses>(in_frame_, request);
  EXPECT_EQ(response.part[0], 0);
  EXPECT_EQ(response.occupancy[0], CheckPoses::Response::OCCUPIED);
}

TEST_F(PoseAnswers, InflateABodyOnce) {
  CheckPoses::Request request;
  request.poses = {yawed(1.05, 0.45, 0.0)};  // 0.15 m from both sides of the door.
  request.unknown = CheckPoses::Request::UNKNOWN_FREE;
  request.inflation = 0.03;
  request.spheres = {point(0, 0, 0)};
  request.radii = {0.11};
  EXPECT_TRUE(answer<CheckPoses>(in_frame_, request).free[0]);
  request.spheres.clear();
  request.radii.clear();
  request.boxes.resize(1);
  request.sizes = {vector(0.1, 0.22, 0.1)};
  EXPECT_TRUE(answer<CheckPoses>(in_frame_, request).free[0]);
  request.sizes = {vector(0.1, 0.26, 0.1)};
  EXPECT_FALSE(answer<CheckPoses>(in_frame_, request).free[0]);
}

TEST_F(PoseAnswers, AreExactInAFrameThatIsTurned) {
  geometry_msgs::TransformStamped transform = tf2::eigenToTransform(Eigen::Isometry3d(
      Eigen::Translation3d(1.05, 0.45, 0.5) * Eigen::AngleAxisd(-0.1, Eigen::Vector3d::UnitZ())));
  transform.header.frame_id = "map";
  transform.child_frame_id = "tilted";
  ASSERT_TRUE(tf_.setTransform(transform, "test", true));
  auto request = makeRequest();
  request.header.frame_id = "tilted";
  request.poses = {yawed(0.0, 0.0, 0.1), yawed(0.0, 0.0, 0.1 + M_PI / 2)};
  for (auto& pose : request.poses) pose.position.z = 0.0;
  const auto response = answer<CheckPoses>(in_frame_, request);
  EXPECT_EQ(response.free, (std::vector<std::uint8_t>{1, 0}));
  EXPECT_FALSE(response.info.enclosing);
}

TEST_F(PoseAnswers, RefuseWhatIsNoPoseOrNoBody) {
  const auto ask = [&](auto change) {
    auto request = makeRequest();
    change(request);
    return answer<CheckPoses>(in_frame_, request);
  };
  expectRefusal(ask([](auto& r) { r.poses[1].position.x = NAN; }), "poses[1].position");
  expectRefusal(ask([](auto& r) { r.poses[2].orientation.w = 2.0; }), "normalize the quaternion");
  expectRefusal(ask([](auto& r) { r.poses[0].orientation.z = NAN; }), "poses[0].orientation");
  expectRefusal(ask([](auto& r) { r.boxes[0].orientation.x = 3.0; }), "boxes[0].orientation");
  expectRefusal(ask([](auto& r) { r.poses[0].position.x = 1e12; }), "beyond the map");
  expectRefusal(ask([](auto& r) { r.sizes.clear(); }), "there are 1 boxes and 0 sizes");
  expectRefusal(ask([](auto& r) { r.radii = {0.1}; }), "there are 0 spheres and 1 radii");
  expectRefusal(ask([](auto& r) { r.sizes[0].x = 0.0; }), "boxes[0]: radii and edges");
  expectRefusal(ask([](auto& r) { r.sizes[0].z = 1000.0; }), "at most 409.6 m");
  expectRefusal(ask([](auto& r) { r.inflation = -0.1; }), "inflation");
  expectRefusal(ask([](auto& r) { r.inflation = 1000.0; }), "at most 409.6 m");
  expectRefusal(ask([](auto& r) { r.unknown = 7; }), "UNKNOWN_FREE");
  expectRefusal(ask([](auto& r) {
                  r.boxes.clear();
                  r.sizes.clear();
                }),
                "the body has no part");
  EXPECT_TRUE(ask([](auto& r) { r.poses.clear(); }).info.success) << "no poses are no fault";
}

TEST_F(PoseAnswers, EndWithTheLimitsOfTheNode) {
  MapInFrame limited = in_frame_;
  limited.limits.max_bricks = 2;
  const auto response = answer<CheckPoses>(limited, makeRequest());
  EXPECT_TRUE(response.info.truncated);
  EXPECT_LT(response.info.answered, 3U);
  EXPECT_FALSE(response.free[2]);
  MapInFrame few = in_frame_;
  few.limits.max_entries = 2;
  expectRefusal(answer<CheckPoses>(few, makeRequest()), "3 poses in one request");
}

}  // namespace
}  // namespace cuboid_mapping_ros
