// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/planning/planner_services.h"

#include "ros/map_in_frame.h"

#include <cmath>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::FindCorridor;
using cuboid_mapping::FindNearest;
using cuboid_mapping::FindNearestFree;
using cuboid_mapping::GetCuboids;
using cuboid_mapping::GetFreeGraph;
using cuboid_mapping::MapCuboid;

double volumeOf(const GetCuboids::Response& cuboids) {
  double volume = 0.0;
  for (const cuboid_mapping::MapCuboid& cuboid : cuboids.cuboids) {
    volume += (toVector(cuboid.max) - toVector(cuboid.min)).prod();
  }
  return volume;
}

class SearchAnswers : public test::MapInFrameTest {
 protected:
  static FindCorridor::Request makeTask() {
    FindCorridor::Request request;
    request.start = point(0.5, 0.5, 0.5);
    request.goal = point(1.5, 0.5, 0.5);
    request.size = vector(0.3, 0.3, 0.3);
    return request;
  }
};

TEST_F(SearchAnswers, TellTheNearestCuboidsOfAClass) {
  FindNearest::Request request;
  request.points = {point(0.5, 0.1, 0.5), point(0.5, 0.9, 0.5)};
  request.classes = FindNearest::Request::OCCUPIED;
  request.k = 2;
  const auto response = answer<FindNearest>(in_frame_, request);
  expectHead(response);
  EXPECT_EQ(response.counts, (std::vector<std::uint32_t>{2, 2}));
  EXPECT_NEAR(response.distance[0], 0.5, 1e-9);
  expectNear(response.closest[0], 1.0, 0.1, 0.5);
  EXPECT_NEAR(response.direction[0].x, 1.0, 1e-9);
  expectNear(response.cuboids[0].min, 1.0, 0.0, 0.0);
  expectNear(response.cuboids[2].max, 1.1, 1.0, 0.8);  // Bricks end at 0.8 m.
  EXPECT_EQ(response.cuboids[3].occupancy, MapCuboid::OCCUPIED);
  EXPECT_NEAR(response.cuboids[3].probability, 1.0 / (1.0 + std::exp(-1.0)), 1e-6);

  request.inflation = 0.2;
  EXPECT_NEAR(answer<FindNearest>(in_frame_, request).distance[0], 0.3, 1e-9);
  request.max_distance = 0.305;
  EXPECT_EQ(answer<FindNearest>(in_frame_, request).counts, (std::vector<std::uint32_t>{1, 1}));
}

TEST_F(SearchAnswers, RefuseToLookForNothing) {
  FindNearest::Request request;
  request.points = {point(0, 0, 0)};
  request.k = 1;
  expectRefusal(answer<FindNearest>(in_frame_, request), "classes is 0");
  request.classes = FindNearest::Request::ALL;
  request.k = 0;
  expectRefusal(answer<FindNearest>(in_frame_, request), "k is 0");
  request.k = 1;
  request.points[0].x = std::nan("");
  expectRefusal(answer<FindNearest>(in_frame_, request), "points[0]");
}

TEST_F(SearchAnswers, TellTheNearestPlaceOfABox) {
  FindNearestFree::Request request;
  request.points = {point(1.05, 0.45, 0.5), point(1.05, 0.1, 0.5), point(9, 9, 9)};
  request.size = vector(0.3, 0.3, 0.3);
  request.max_distance = 1.0;
  auto response = answer<FindNearestFree>(in_frame_, request);
  expectHead(response);
  EXPECT_EQ(response.found, (std::vector<std::uint8_t>{1, 1, 0}));
  expectNear(response.place[0], 1.05, 0.45, 0.5);
  EXPECT_NEAR(response.distance[1], std::hypot(0.2, 0.05), 1e-6);
  EXPECT_EQ(response.distance[2], INFINITY);
  EXPECT_NE(response.info.message.find("1 point without a place"), std::string::npos);
  request.unknown = FindNearestFree::Request::UNKNOWN_FREE;
  EXPECT_TRUE(answer<FindNearestFree>(in_frame_, request).found[2]);
  request.max_distance = 0.0;
  expectRefusal(answer<FindNearestFree>(in_frame_, request), "max_distance");
  request.max_distance = 1.0;
  request.size.x = -1.0;
  expectRefusal(answer<FindNearestFree>(in_frame_, request), "every edge");
}

TEST_F(SearchAnswers, GiveTheCuboidsOfARegion) {
  GetCuboids::Request request;
  request.everything = true;
  request.classes = GetCuboids::Request::ALL;
  auto response = answer<GetCuboids>(in_frame_, request);
  expectHead(response);
  EXPECT_EQ(response.cuboids.size(), 24U);
  EXPECT_NEAR(volumeOf(response), 2.0, 1e-9) << "each voxel of the room once";
  EXPECT_FALSE(response.info.truncated);
  request.limit = 3;
  response = answer<GetCuboids>(in_frame_, request);
  EXPECT_EQ(response.cuboids.size(), 3U);
  EXPECT_TRUE(response.info.truncated);
  request.limit = 0;
  request.min_edge = 0.11;
  request.classes = GetCuboids::Request::FREE;
  EXPECT_EQ(answer<GetCuboids>(in_frame_, request).cuboids.size(), 16U) << "without the door";
  request.min_edge = 0.0;

  request.everything = false;
  request.region = box({0.5, 0.2, 0.2}, {0.8, 0.4, 0.4});
  request.clip = true;
  response = answer<GetCuboids>(in_frame_, request);
  ASSERT_EQ(response.cuboids.size(), 1U);
  expectNear(response.cuboids[0].min, 0.5, 0.2, 0.2);
  expectNear(response.cuboids[0].max, 0.8, 0.4, 0.4);
  EXPECT_EQ(response.cuboids[0].occupancy, MapCuboid::FREE);
  request.region.max.x = 0.5;
  expectRefusal(answer<GetCuboids>(in_frame_, request), "less than max");
}

TEST_F(SearchAnswers, CoverARegionByFewBoxes) {
  GetCuboids::Request request;
  request.everything = true;
  request.min_edge = -1.0;  // Ignored, as `classes` is.
  request.max_boxes = 1;
  request.keep_passages.x = request.keep_passages.y = request.keep_passages.z = -1.0;
  auto response = answer<GetCuboids>(in_frame_, request);
  expectHead(response);
  ASSERT_EQ(response.cuboids.size(), 1U);
  EXPECT_NEAR(volumeOf(response), 0.1, 1e-9) << "the wall with the door";
  EXPECT_NEAR(response.added_volume, 0.03, 1e-9);
  EXPECT_TRUE(response.lost.empty());
  request.keep_passages.x = request.keep_passages.y = 0.3;
  request.keep_passages.z = 0.2;
  response = answer<GetCuboids>(in_frame_, request);
  ASSERT_EQ(response.lost.size(), 1U) << "one side of the wall";
  expectNear(response.lost[0].max, response.lost[0].min.x + 0.3, response.lost[0].min.y + 0.3,
             response.lost[0].min.z + 0.2);

  request.max_boxes = 2;
  response = answer<GetCuboids>(in_frame_, request);
  ASSERT_EQ(response.cuboids.size(), 2U);
  EXPECT_EQ(response.added_volume, 0.0);
  EXPECT_TRUE(response.lost.empty());
  for (const int i : {1, 0}) {  // In the other order.
    request.previous.emplace_back();
    request.previous.back().min = response.cuboids[i].min;
    request.previous.back().max = response.cuboids[i].max;
  }
  const auto again = answer<GetCuboids>(in_frame_, request);
  ASSERT_EQ(again.cuboids.size(), 2U);
  EXPECT_EQ(again.cuboids[0].min.y, response.cuboids[1].min.y);
  EXPECT_EQ(again.cuboids[1].min.y, response.cuboids[0].min.y);

  request.keep_free = {box({1.0, 0.1, 0.1}, {1.1, 0.2, 0.2})};
  expectRefusal(answer<GetCuboids>(in_frame_, request), "boxes are needed");
  request.keep_free.clear();
  request.keep_passages.y = std::numeric_limits<double>::quiet_NaN();
  expectRefusal(answer<GetCuboids>(in_frame_, request), "keep_passages");
}

TEST_F(SearchAnswers, JoinCuboidsAcrossBricksWhenAskedTo) {
  GetCuboids::Request request;
  request.everything = true;
  request.classes = GetCuboids::Request::OCCUPIED;
  request.joined = true;
  auto response = answer<GetCuboids>(in_frame_, request);
  expectHead(response);
  ASSERT_EQ(response.cuboids.size(), 2U) << "a wall on each side of the door";
  EXPECT_NEAR(volumeOf(response), 0.07, 1e-9);
  const auto& narrow = response.cuboids[response.cuboids[0].min.y < 0.5 ? 0 : 1];
  expectNear(narrow.min, 1.0, 0.0, 0.0);
  expectNear(narrow.max, 1.1, 0.3, 1.0);
  EXPECT_NEAR(narrow.probability, 1.0 / (1.0 + std::exp(-1.0)), 1e-6);
  request.min_edge = 0.11;
  EXPECT_TRUE(answer<GetCuboids>(in_frame_, request).cuboids.empty());
  request.min_edge = 0.0;
  request.limit = 1;
  response = answer<GetCuboids>(in_frame_, request);
  EXPECT_EQ(response.cuboids.size(), 1U);
  EXPECT_TRUE(response.info.truncated);

  request.limit = 0;
  request.everything = false;
  request.region = box({0.5, 0.1, 0.2}, {1.5, 0.2, 0.4});
  response = answer<GetCuboids>(in_frame_, request);
  ASSERT_EQ(response.cuboids.size(), 1U);
  expectNear(response.cuboids[0].min, 1.0, 0.1, 0.2);
  expectNear(response.cuboids[0].max, 1.1, 0.2, 0.4);
}

TEST_F(SearchAnswers, GiveTheMeanProbabilityOfTheVoxelsOfACuboid) {
  map_.change(ros::Time(7.0), [](cuboid_mapping::CuboidMap& map) {
    const cuboid_mapping::CellBox half{{0, 0, 0}, {4, 8, 8}};
    return map.replace(half, {cuboid_mapping::UniformBox{half, -2.0F}});
  });
  GetCuboids::Request request;
  request.classes = GetCuboids::Request::ALL;
  request.region.max = point(0.8, 0.8, 0.8);
  const auto response = answer<GetCuboids>(in_frame_, request);
  ASSERT_EQ(response.cuboids.size(), 1U) << "one class, one cuboid";
  const double mean = 0.5 / (1.0 + std::exp(1.0)) + 0.5 / (1.0 + std::exp(2.0));
  EXPECT_NEAR(response.cuboids[0].probability, mean, 1e-6);
}

TEST_F(SearchAnswers, GiveTheFreeGraph) {
  GetFreeGraph::Request request;
  request.region = box({0.8, 0, 0}, {1.6, 0.8, 0.8});  // One brick.
  auto response = answer<GetFreeGraph>(in_frame_, request);
  expectHead(response);
  EXPECT_EQ(response.cuboids.size(), 3U);
  ASSERT_EQ(response.first.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    const auto& face = response.portals[i];
    EXPECT_EQ(face.min.x, face.max.x);
    EXPECT_NEAR(face.max.y - face.min.y, 0.3, 1e-9);
    EXPECT_LT(response.cuboids[response.first[i]].min.x,
              response.cuboids[response.second[i]].min.x);
  }
  request.size = vector(0.5, 0.3, 0.8);
  EXPECT_EQ(answer<GetFreeGraph>(in_frame_, request).first.size(), 2U) << "just as wide";
  request.size.y = 0.31;
  EXPECT_TRUE(answer<GetFreeGraph>(in_frame_, request).first.empty()) << "wider";
  request.limit = 1;
  EXPECT_TRUE(answer<GetFreeGraph>(in_frame_, request).info.truncated);
  request.size.y = -0.3;
  expectRefusal(answer<GetFreeGraph>(in_frame_, request), "every edge");
  request.size = vector(0, 0, 0);
  request.inflation = 0.1;
  expectRefusal(answer<GetFreeGraph>(in_frame_, request), "every edge");
}

TEST_F(SearchAnswers, GiveACorridor) {
  const auto response = answer<FindCorridor>(in_frame_, makeTask());
  expectHead(response);
  EXPECT_EQ(response.result, FindCorridor::Response::FOUND);
  EXPECT_EQ(response.info.message, "");
  ASSERT_EQ(response.boxes.size(), 3U);
  EXPECT_EQ(response.portals.size(), 2U);
  ASSERT_EQ(response.path.poses.size(), 4U);
  EXPECT_EQ(response.path.header.frame_id, "map");
  expectNear(response.path.poses.front().pose.position, 0.5, 0.5, 0.5);
  expectNear(response.path.poses.back().pose.position, 1.5, 0.5, 0.5);
  for (std::size_t i = 0; i + 1 < response.path.poses.size(); ++i) {
    const auto& from = response.path.poses[i].pose;
    const auto& to = response.path.poses[i + 1].pose.position;
    EXPECT_NEAR(2.0 * std::atan2(from.orientation.z, from.orientation.w),
                std::atan2(to.y - from.position.y, to.x - from.position.x), 1e-9);
  }
  EXPECT_GE(response.length, 1.0);
}

TEST_F(SearchAnswers, SayWhyThereIsNoCorridor) {
  auto request = makeTask();
  request.inflation = 0.05;
  auto response = answer<FindCorridor>(in_frame_, request);
  expectHead(response);
  EXPECT_EQ(response.result, FindCorridor::Response::NO_WAY);
  EXPECT_NE(response.info.message.find("no way"), std::string::npos);
  EXPECT_TRUE(response.boxes.empty());
  request = makeTask();
  request.start = point(1.05, 0.1, 0.5);
  response = answer<FindCorridor>(in_frame_, request);
  EXPECT_EQ(response.result, FindCorridor::Response::START_BLOCKED);
  EXPECT_NE(response.info.message.find("start touches an obstacle"), std::string::npos);
  request = makeTask();
  request.goal = point(5, 5, 5);
  response = answer<FindCorridor>(in_frame_, request);
  EXPECT_EQ(response.result, FindCorridor::Response::GOAL_BLOCKED);
  EXPECT_NE(response.info.message.find("goal touches unknown space"), std::string::npos);
  EXPECT_NE(response.info.message.find("unknown: 1"), std::string::npos);
  request.unknown = FindCorridor::Request::UNKNOWN_FREE;
  EXPECT_EQ(answer<FindCorridor>(in_frame_, request).result, FindCorridor::Response::FOUND);
  request.region = box({0, 0, 0}, {2, 1, 1});
  expectRefusal(answer<FindCorridor>(in_frame_, request), "use_region: true");
  request.use_region = true;
  response = answer<FindCorridor>(in_frame_, request);
  EXPECT_EQ(response.result, FindCorridor::Response::GOAL_BLOCKED);
  EXPECT_NE(response.info.message.find("goal leaves the region"), std::string::npos);
  request.region.max.x = 0.0;
  expectRefusal(answer<FindCorridor>(in_frame_, request), "less than max");
  request = makeTask();
  request.goal.z = std::nan("");
  expectRefusal(answer<FindCorridor>(in_frame_, request), "goal");
  request = makeTask();
  request.time_limit = std::nan("");
  expectRefusal(answer<FindCorridor>(in_frame_, request), "time_limit");
}

TEST_F(SearchAnswers, LeadOutOfAnObstacleAndNearAGoal) {
  auto request = makeTask();
  request.start = point(0.9, 0.15, 0.5);
  auto response = answer<FindCorridor>(in_frame_, request);
  EXPECT_EQ(response.result, FindCorridor::Response::START_BLOCKED);
  EXPECT_EQ(response.occupancy, FindCorridor::Response::OCCUPIED);
  EXPECT_NEAR(response.point.x, 1.05, 1e-9);
  EXPECT_NE(response.info.message.find("start_tolerance"), std::string::npos);
  request.start_tolerance = 0.1;
  response = answer<FindCorridor>(in_frame_, request);
  expectHead(response);
  EXPECT_EQ(response.result, FindCorridor::Response::FOUND);
  EXPECT_NEAR(response.start_distance, 0.05, 1e-6);
  EXPECT_NE(response.info.message.find("leads out of it first, for 0.05 m"), std::string::npos)
      << response.info.message;
  ASSERT_GE(response.path.poses.size(), 3U);
  expectNear(response.path.poses[1].pose.position, 0.85, 0.15, 0.5);
  EXPECT_EQ(response.occupancy, FindCorridor::Response::OCCUPIED);
  request.start.x = 1.05;  // The centre is in the wall.
  request.start_tolerance = INFINITY;
  response = answer<FindCorridor>(in_frame_, request);
  EXPECT_EQ(response.result, FindCorridor::Response::START_BLOCKED);
  EXPECT_NE(response.info.message.find("no way out is within start_tolerance: move the start"),
            std::string::npos)
      << response.info.message;

  request = makeTask();
  request.goal = point(5, 0.5, 0.5);
  EXPECT_EQ(answer<FindCorridor>(in_frame_, request).result, FindCorridor::Response::GOAL_BLOCKED);
  request.goal_tolerance = request.time_limit = INFINITY;
  response = answer<FindCorridor>(in_frame_, request);
  EXPECT_EQ(response.result, FindCorridor::Response::FOUND);
  EXPECT_EQ(response.occupancy, FindCorridor::Response::UNKNOWN);
  EXPECT_NEAR(response.goal_distance, 3.15, 1e-6);
  expectNear(response.path.poses.back().pose.position, 1.85, 0.5, 0.5);
  EXPECT_NE(response.info.message.find("3.15 m from the goal"), std::string::npos)
      << response.info.message;
  request.headings = {0.0, 0.0};
  response = answer<FindCorridor>(in_frame_, request);
  EXPECT_EQ(response.result, FindCorridor::Response::FOUND);
  EXPECT_NEAR(response.goal_distance, 3.15, 0.11);
  request.goal_tolerance = NAN;
  expectRefusal(answer<FindCorridor>(in_frame_, request), "goal_tolerance");
}

}  // namespace
}  // namespace cuboid_mapping_ros
