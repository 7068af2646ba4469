// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/planning/planner_services.h"

#include "ros/map_in_frame.h"

#include <cmath>
#include <limits>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::GetDistances;
using cuboid_mapping::GetFrontiers;

class DistanceAnswers : public test::MapInFrameTest {
 protected:
  static GetDistances::Request makePoints() {
    GetDistances::Request request;
    request.points = {point(0.55, 0.15, 0.55), point(1.05, 0.15, 0.55), point(0.55, 0.15, 0.45)};
    request.max_distance = 0.45;
    request.unknown = GetDistances::Request::UNKNOWN_FREE;
    return request;
  }
  static GetFrontiers::Request makeTask() {
    GetFrontiers::Request request;
    request.everything = true;
    request.size = vector(0.3, 0.3, 0.3);
    request.max_distance = 1.0;
    request.view_range = 1.0;
    return request;
  }
};

TEST_F(DistanceAnswers, TellHowFarObstaclesAre) {
  auto request = makePoints();
  auto response = answer<GetDistances>(in_frame_, request);
  expectHead(response);
  constexpr double kNever = std::numeric_limits<double>::infinity();
  EXPECT_EQ(response.distance, (std::vector<double>{kNever, 0.0, kNever}));
  request.max_distance = 0.5;
  response = answer<GetDistances>(in_frame_, request);
  EXPECT_NEAR(response.distance[0], 0.5, 1e-9);
  EXPECT_NEAR(response.gradient[0].x, -1.0, 1e-9);
  EXPECT_EQ(response.gradient[1].x, 0.0);
  request.unknown = GetDistances::Request::UNKNOWN_OBSTACLE;
  response = answer<GetDistances>(in_frame_, request);
  EXPECT_NEAR(response.distance[0], 0.2, 1e-9) << "below the room";
  EXPECT_NEAR(response.gradient[0].y, 1.0, 1e-9);
}

TEST_F(DistanceAnswers, KeepWithinTheLimits) {
  MapInFrame limited = in_frame_;
  limited.limits.max_bricks = 3;
  const auto response = answer<GetDistances>(limited, makePoints());
  EXPECT_TRUE(response.info.truncated);
  EXPECT_LT(response.info.answered, 3U);
  auto request = makePoints();
  request.max_distance = 0.0;
  expectRefusal(answer<GetDistances>(in_frame_, request), "max_distance is 0");
  request.max_distance = 1e12;
  expectRefusal(answer<GetDistances>(in_frame_, request), "beyond the map");
  request = makePoints();
  request.points[1].y = NAN;
  expectRefusal(answer<GetDistances>(in_frame_, request), "points[1]");
}

TEST_F(DistanceAnswers, TellWhereUnknownSpaceBegins) {
  auto request = makeTask();
  auto response = answer<GetFrontiers>(in_frame_, request);
  expectHead(response);
  ASSERT_EQ(response.counts.size(), 1U) << "around the room, through the door";
  EXPECT_GT(response.counts[0], 400U);
  EXPECT_TRUE(response.voxels.empty());
  EXPECT_TRUE(response.found[0]);
  EXPECT_GT(response.unknown_volume[0], 0.1);
  request.with_voxels = true;
  response = answer<GetFrontiers>(in_frame_, request);
  EXPECT_EQ(response.voxels.size(), response.counts[0]);

  request.everything = false;
  request.region = box({0.0, 0.0, 0.2}, {0.1, 0.4, 0.6});
  request.size = vector(3.0, 3.0, 3.0);
  response = answer<GetFrontiers>(in_frame_, request);
  ASSERT_EQ(response.counts.size(), 1U);
  EXPECT_EQ(response.counts[0], 16U);
  EXPECT_FALSE(response.found[0]) << "the robot is larger than the room";
  EXPECT_EQ(response.unknown_volume[0], 0.0);
  request.min_voxels = 17;
  EXPECT_TRUE(answer<GetFrontiers>(in_frame_, request).counts.empty());
}

TEST_F(DistanceAnswers, RefuseWhatIsNoTaskForFrontiers) {
  const auto ask = [&](auto change) {
    auto request = makeTask();
    change(request);
    return answer<GetFrontiers>(in_frame_, request);
  };
  expectRefusal(ask([](auto& r) { r.size.x = 0.0; }), "every edge must be a number > 0");
  expectRefusal(ask([](auto& r) { r.max_distance = -1.0; }), "max_distance");
  expectRefusal(ask([](auto& r) { r.view_range = 51.0; }), "at most 50");
  expectRefusal(ask([](auto& r) { r.view_range = NAN; }), "view_range is NaN");
  expectRefusal(ask([](auto& r) { r.everything = false; }), "region: ");
  MapInFrame limited = in_frame_;
  limited.limits.max_bricks = 4;
  const auto response = answer<GetFrontiers>(limited, makeTask());
  EXPECT_TRUE(response.info.truncated);
  EXPECT_NE(response.info.message.find("smaller region"), std::string::npos);
}

}  // namespace
}  // namespace cuboid_mapping_ros
