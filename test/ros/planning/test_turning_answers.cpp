// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/planning/planner_services.h"

#include "ros/map_in_frame.h"

#include <cmath>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::CheckPath;
using cuboid_mapping::FindCorridor;

double headingOf(const geometry_msgs::Quaternion& orientation) {
  return 2.0 * std::atan2(orientation.z, orientation.w);
}

/// A base of 0.5 x 0.2 m, which passes the door of 0.3 m along its length only.
class TurningAnswers : public test::MapInFrameTest {
 protected:
  static CheckPath::Request makePath() {
    CheckPath::Request request;
    request.waypoints = {point(0.4, 0.45, 0.5), point(0.4, 0.45, 0.5), point(1.6, 0.45, 0.5)};
    request.headings = {M_PI / 2, 0.0, 0.0};
    request.size = vector(0.5, 0.2, 0.2);
    return request;
  }
  static FindCorridor::Request makeTask() {
    FindCorridor::Request request;
    request.start = point(0.4, 0.5, 0.5);
    request.goal = point(1.6, 0.5, 0.5);
    request.size = vector(0.5, 0.2, 0.2);
    request.headings = {M_PI / 2, M_PI / 2};
    return request;
  }
  void setTilted(const Eigen::Vector3d& axis) {
    geometry_msgs::TransformStamped transform =
        tf2::eigenToTransform(Eigen::Isometry3d(Eigen::AngleAxisd(0.1, axis)));
    transform.header.frame_id = "map";
    transform.child_frame_id = "tilted";
    ASSERT_TRUE(tf_.setTransform(transform, "test", true));
  }
};

TEST_F(TurningAnswers, TellWhereAPathWithHeadingsIsBlockedFirst) {
  auto request = makePath();
  auto response = answer<CheckPath>(in_frame_, request);
  expectHead(response);
  EXPECT_EQ(response.free, (std::vector<std::uint8_t>{1}));
  EXPECT_EQ(response.segment[0], -1);
  EXPECT_NEAR(response.free_length[0], 1.2, 1e-9);
  EXPECT_NEAR(headingOf(response.orientation.at(0)), 0.0, 1e-9);
  // It turns too late.
  request.headings[1] = M_PI / 2;
  response = answer<CheckPath>(in_frame_, request);
  EXPECT_EQ(response.free, (std::vector<std::uint8_t>{0}));
  EXPECT_EQ(response.segment[0], 1);
  EXPECT_EQ(response.occupancy[0], CheckPath::Response::OCCUPIED);
  EXPECT_NEAR(response.length[0], 1.2, 1e-9);
  EXPECT_NEAR(response.point[0].x, 0.4 + response.free_length[0], 1e-9);
  EXPECT_NEAR(headingOf(response.orientation.at(0)),
              M_PI / 2 * (1.0 - response.free_length[0] / 1.2), 1e-6);
  // Without headings the box does not turn, and the answer has none.
  request.headings.clear();
  EXPECT_TRUE(answer<CheckPath>(in_frame_, request).free[0]);
  EXPECT_TRUE(answer<CheckPath>(in_frame_, request).orientation.empty());
}

TEST_F(TurningAnswers, AreThoseOfTheBoxInEveryFrame) {
  auto request = makePath();
  request.header.frame_id = "turned";  // Its (x, y) is the map's (5 - y, x).
  for (auto& waypoint : request.waypoints) waypoint = point(waypoint.y, 5.0 - waypoint.x, 0.5);
  for (double& heading : request.headings) heading -= M_PI / 2;
  const auto response = answer<CheckPath>(in_frame_, request);
  expectHead(response);
  EXPECT_TRUE(response.free[0]);
  EXPECT_NEAR(headingOf(response.orientation[0]), 0.0, 1e-9) << "of the map";
  setTilted(Eigen::Vector3d::UnitZ());
  auto diagonal = makePath();
  diagonal.header.frame_id = "tilted";
  EXPECT_FALSE(answer<CheckPath>(in_frame_, diagonal).info.enclosing);
}

TEST_F(TurningAnswers, CheckManyPathsWithHeadings) {
  auto request = makePath();
  request.lengths = {1, 2};
  request.headings = {M_PI / 2, 0.0, 0.0};
  auto response = answer<CheckPath>(in_frame_, request);
  EXPECT_EQ(response.free, (std::vector<std::uint8_t>{1, 1}));
  EXPECT_NEAR(headingOf(response.orientation.at(0)), M_PI / 2, 1e-9);
  MapInFrame limited = in_frame_;
  limited.limits.max_bricks = 4;
  response = answer<CheckPath>(limited, request);
  EXPECT_TRUE(response.info.truncated);
  EXPECT_FALSE(response.free[1]);
}

TEST_F(TurningAnswers, RefuseHeadingsThatAreNone) {
  const auto ask = [&](auto change) {
    auto request = makePath();
    change(request);
    return answer<CheckPath>(in_frame_, request);
  };
  expectRefusal(ask([](auto& r) { r.headings.pop_back(); }), "2 headings and 3 waypoints");
  expectRefusal(ask([](auto& r) { r.headings[1] = NAN; }), "the heading of waypoints[1]");
  expectRefusal(ask([](auto& r) { r.headings[2] = M_PI; }), "path 0: waypoints[1] to waypoints[2]");
  expectRefusal(ask([](auto& r) { r.headings[2] = -M_PI; }), "give a pose in between");
  expectRefusal(ask([](auto& r) { r.waypoints[2].x = NAN; }), "waypoints[2]");
  expectRefusal(ask([](auto& r) { r.waypoints[2].x = 1e12; }), "range of the grid");
  expectRefusal(ask([](auto& r) { r.size.x = 0.0; }), "every edge");
  expectRefusal(ask([](auto& r) { r.size.x = 1000.0; }), "at most 409.6 m");
  expectRefusal(ask([](auto& r) { r.inflation = -1.0; }), "inflation");
}

TEST_F(TurningAnswers, TurnABaseThroughADoor) {
  const auto response = answer<FindCorridor>(in_frame_, makeTask());
  expectHead(response);
  ASSERT_EQ(response.result, FindCorridor::Response::FOUND) << response.info.message;
  EXPECT_TRUE(response.boxes.empty());
  EXPECT_TRUE(response.portals.empty());
  const auto& poses = response.path.poses;
  ASSERT_GE(poses.size(), 4U);
  EXPECT_EQ(response.path.header.frame_id, "map");
  expectNear(poses.front().pose.position, 0.4, 0.5, 0.5);
  expectNear(poses.back().pose.position, 1.6, 0.5, 0.5);
  CheckPath::Request check;
  check.size = makeTask().size;
  for (const auto& pose : poses) {
    check.waypoints.push_back(pose.pose.position);
    check.headings.push_back(headingOf(pose.pose.orientation));
  }
  const auto checked = answer<CheckPath>(in_frame_, check);
  EXPECT_TRUE(checked.free.at(0)) << checked.info.message;
  EXPECT_NEAR(checked.length.at(0), response.length, 1e-9);
  // A box that does not turn stands across.
  auto stiff = makeTask();
  stiff.headings.clear();
  stiff.size = vector(0.2, 0.5, 0.2);
  EXPECT_EQ(answer<FindCorridor>(in_frame_, stiff).result, FindCorridor::Response::NO_WAY);
}

TEST_F(TurningAnswers, SayWhyThereIsNoWay) {
  const auto ask = [&](auto change) {
    auto request = makeTask();
    change(request);
    return answer<FindCorridor>(in_frame_, request);
  };
  auto response = ask([](auto& r) { r.inflation = 0.06; });
  EXPECT_EQ(response.result, FindCorridor::Response::NO_WAY);
  EXPECT_NE(response.info.message.find("no way"), std::string::npos);
  response = ask([](auto& r) { r.start = point(1.05, 0.45, 0.5); });
  EXPECT_EQ(response.result, FindCorridor::Response::START_BLOCKED);
  EXPECT_NE(response.info.message.find("start touches an obstacle at (1.05"), std::string::npos);
  EXPECT_NE(response.info.message.find("start_tolerance"), std::string::npos);
  EXPECT_NEAR(response.point.x, 1.05, 1e-9);
  response = ask([](auto& r) { r.goal = point(1.9, 0.2, 0.5); });
  EXPECT_EQ(response.result, FindCorridor::Response::GOAL_BLOCKED);
  EXPECT_NE(response.info.message.find("goal touches unknown space"), std::string::npos);
  response = ask([](auto& r) {
    r.use_region = true;
    r.region = box({0, 0, 0}, {1.6, 1, 1});
  });
  EXPECT_EQ(response.result, FindCorridor::Response::GOAL_BLOCKED);
  EXPECT_NE(response.info.message.find("goal leaves the region"), std::string::npos);
  MapInFrame limited = in_frame_;
  limited.limits.max_bricks = 100;
  response = answer<FindCorridor>(limited, makeTask());
  EXPECT_EQ(response.result, FindCorridor::Response::TIME_LIMIT);
  EXPECT_TRUE(response.info.truncated);
  EXPECT_NE(response.info.message.find(" bricks"), std::string::npos);
}

TEST_F(TurningAnswers, RefuseATaskThatIsNone) {
  const auto ask = [&](auto change) {
    auto request = makeTask();
    change(request);
    return answer<FindCorridor>(in_frame_, request);
  };
  expectRefusal(ask([](auto& r) { r.headings.pop_back(); }), "give two, for start and goal");
  expectRefusal(ask([](auto& r) { r.headings[1] = NAN; }), "the heading of goal");
  expectRefusal(ask([](auto& r) { r.start.x = NAN; }), "start");
  expectRefusal(ask([](auto& r) { r.goal.z = 0.7; }), "climb");
  expectRefusal(ask([](auto& r) { r.goal.y = 1e12; }), "beyond the map");
  expectRefusal(ask([](auto& r) { r.size.y = -1.0; }), "every edge");
  expectRefusal(ask([](auto& r) { r.size.y = 2000.0; }), "at most 409.6 m");
  expectRefusal(ask([](auto& r) { r.time_limit = NAN; }), "time_limit");
  EXPECT_EQ(ask([](auto& r) {
              r.goal.z = 0.7;
              r.climb = true;
            }).result,
            FindCorridor::Response::FOUND);
  setTilted(Eigen::Vector3d::UnitX());
  expectRefusal(ask([](auto& r) { r.header.frame_id = "tilted"; }), "start tilts");
}

}  // namespace
}  // namespace cuboid_mapping_ros
