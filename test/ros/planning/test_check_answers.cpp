// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/planning/planner_services.h"

#include "ros/map_in_frame.h"

#include <cmath>
#include <limits>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::CastRays;
using cuboid_mapping::CheckBoxes;
using cuboid_mapping::CheckPath;

class CheckAnswers : public test::MapInFrameTest {
 protected:
  static CheckBoxes::Request makeBoxes() {
    CheckBoxes::Request request;
    request.boxes = {box({0.1, 0.1, 0.1}, {0.5, 0.5, 0.5}), box({0.9, 0.0, 0.0}, {1.1, 0.1, 0.1}),
                     box({-0.5, 0.0, 0.0}, {0.5, 0.1, 0.1})};
    return request;
  }
  static CheckPath::Request makePath() {
    CheckPath::Request request;
    request.waypoints = {point(0.5, 0.45, 0.5), point(1.5, 0.45, 0.5), point(1.5, 0.8, 0.5)};
    request.size = vector(0.3, 0.3, 0.3);
    return request;
  }
  static CastRays::Request makeRay() {
    CastRays::Request request;
    request.origins = {point(0.55, 0.15, 0.55)};
    request.directions = {vector(2, 0, 0)};
    request.max_range = 3.0;
    return request;
  }
};

TEST_F(CheckAnswers, TellClassVolumesAndProbabilityOfEachBox) {
  const auto response = answer<CheckBoxes>(in_frame_, makeBoxes());
  expectHead(response);
  EXPECT_EQ(response.occupancy,
            (std::vector<std::uint8_t>{CheckBoxes::Response::FREE, CheckBoxes::Response::OCCUPIED,
                                       CheckBoxes::Response::UNKNOWN}));
  EXPECT_EQ(response.blocked, (std::vector<std::uint8_t>{0, 1, 1}));
  EXPECT_NEAR(response.free_volume[0], 0.064, 1e-9);
  EXPECT_NEAR(response.free_volume[1], 0.001, 1e-9);
  EXPECT_NEAR(response.occupied_volume[1], 0.001, 1e-9);
  EXPECT_NEAR(response.unknown_volume[2], 0.005, 1e-9);
  EXPECT_NEAR(response.max_probability[1], 1.0 / (1.0 + std::exp(-1.0)), 1e-6);
}

TEST_F(CheckAnswers, LetUnknownSpacePassAndInflateBoxesWhenAskedTo) {
  auto request = makeBoxes();
  request.unknown = CheckBoxes::Request::UNKNOWN_FREE;
  EXPECT_EQ(answer<CheckBoxes>(in_frame_, request).blocked, (std::vector<std::uint8_t>{0, 1, 0}));
  request.inflation = 0.1;
  EXPECT_EQ(answer<CheckBoxes>(in_frame_, request).occupancy[0], CheckBoxes::Response::FREE);
  request.inflation = 0.11;
  EXPECT_EQ(answer<CheckBoxes>(in_frame_, request).occupancy[0], CheckBoxes::Response::UNKNOWN);
}

TEST_F(CheckAnswers, TakeBoxesToTheFrameOfTheMap) {
  CheckBoxes::Request request;
  request.header.frame_id = "/turned";
  request.boxes = {box({0.0, 3.9, 0.0}, {0.3, 4.0, 1.0})};  // The wall beside the door.
  const auto response = answer<CheckBoxes>(in_frame_, request);
  expectHead(response);
  EXPECT_NEAR(response.occupied_volume[0], 0.03, 1e-9);
  EXPECT_FALSE(response.info.enclosing) << "a turn by 90 degrees is exact";
  request.header.frame_id = "nowhere";
  expectRefusal(answer<CheckBoxes>(in_frame_, request), "nowhere");
}

TEST_F(CheckAnswers, SayThatTheyAreForEnclosingBoxes) {
  geometry_msgs::TransformStamped transform = tf2::eigenToTransform(
      Eigen::Isometry3d(Eigen::AngleAxisd(M_PI / 4.0, Eigen::Vector3d::UnitZ())));
  transform.header.frame_id = "map";
  transform.child_frame_id = "tilted";
  ASSERT_TRUE(tf_.setTransform(transform, "test", true));
  CheckBoxes::Request boxes;
  boxes.header.frame_id = "tilted";
  boxes.boxes = {box({0.5, -0.05, 0.5}, {0.6, 0.05, 0.6})};
  const auto content = answer<CheckBoxes>(in_frame_, boxes);
  EXPECT_TRUE(content.info.enclosing);
  EXPECT_NEAR(content.free_volume[0], 0.004, 1e-9) << "four voxels for a box of one";
  boxes.header.frame_id = "";
  EXPECT_FALSE(answer<CheckBoxes>(in_frame_, boxes).info.enclosing);
  auto path = makePath();
  path.header.frame_id = "tilted";
  EXPECT_TRUE(answer<CheckPath>(in_frame_, path).info.enclosing);
  auto rays = makeRay();
  rays.header.frame_id = "tilted";
  EXPECT_FALSE(answer<CastRays>(in_frame_, rays).info.enclosing) << "a ray has no box";
}

TEST_F(CheckAnswers, RefuseWhatIsNoBox) {
  const auto with = [](auto change) {
    auto request = makeBoxes();
    change(request);
    return request;
  };
  const auto ask = [this](const CheckBoxes::Request& request) {
    return answer<CheckBoxes>(in_frame_, request);
  };
  expectRefusal(ask(with([](auto& r) { r.boxes[1].max.x = r.boxes[1].min.x; })), "boxes[1]: min");
  expectRefusal(ask(with([](auto& r) { r.boxes[2].max.y = -1.0; })), "less than max");
  expectRefusal(ask(with([](auto& r) { r.boxes[0].min.z = std::nan(""); })), "NaN");
  expectRefusal(ask(with([](auto& r) { r.boxes[0].max.z = INFINITY; })), "infinite");
  expectRefusal(ask(with([](auto& r) { r.boxes[0].max.z = 1e12; })), "beyond the map");
  expectRefusal(ask(with([](auto& r) { r.inflation = -1.0; })), "inflation");
  expectRefusal(ask(with([](auto& r) { r.unknown = 2; })), "UNKNOWN_FREE");
  const auto none = ask(CheckBoxes::Request());
  expectHead(none);
  EXPECT_TRUE(none.occupancy.empty()) << "no boxes are no fault";
}

TEST_F(CheckAnswers, TellWhereAPathIsBlockedFirst) {
  auto request = makePath();
  auto response = answer<CheckPath>(in_frame_, request);
  expectHead(response);
  EXPECT_EQ(response.free, (std::vector<std::uint8_t>{1}));
  EXPECT_EQ(response.segment[0], -1);
  EXPECT_NEAR(response.free_length[0], 1.35, 1e-9);
  expectNear(response.point[0], 1.5, 0.8, 0.5);

  request.waypoints[2].y = 0.9;
  response = answer<CheckPath>(in_frame_, request);
  EXPECT_EQ(response.free, (std::vector<std::uint8_t>{0}));
  EXPECT_EQ(response.segment[0], 1);
  expectNear(response.point[0], 1.5, 0.85, 0.5);
  EXPECT_EQ(response.occupancy[0], CheckPath::Response::UNKNOWN);
  EXPECT_NEAR(response.free_length[0], 1.4, 1e-5);
  EXPECT_NEAR(response.length[0], 1.45, 1e-9);
  request.unknown = CheckPath::Request::UNKNOWN_FREE;
  EXPECT_TRUE(answer<CheckPath>(in_frame_, request).free[0]);
  request.inflation = 0.01;  // Wider than the door.
  response = answer<CheckPath>(in_frame_, request);
  EXPECT_EQ(response.occupancy[0], CheckPath::Response::OCCUPIED);
  EXPECT_EQ(response.segment[0], 0);
}

TEST_F(CheckAnswers, LookAtManyPathsAtOnce) {
  auto request = makePath();
  request.lengths = {1, 2};
  const auto response = answer<CheckPath>(in_frame_, request);
  expectHead(response);
  EXPECT_EQ(response.free, (std::vector<std::uint8_t>{1, 1}));
  EXPECT_NEAR(response.length[1], 0.35, 1e-9);
  request.lengths = {1, 1};
  expectRefusal(answer<CheckPath>(in_frame_, request), "add up to 2");
  request.lengths = {0, 3};
  expectRefusal(answer<CheckPath>(in_frame_, request), "must have at least one waypoint");
}

TEST_F(CheckAnswers, RefuseWhatIsNoPath) {
  auto request = makePath();
  request.size = vector(0.3, 0.0, 0.3);
  expectRefusal(answer<CheckPath>(in_frame_, request), "every edge");
  request = makePath();
  request.waypoints[1].x = std::nan("");
  expectRefusal(answer<CheckPath>(in_frame_, request), "waypoints[1]");
  request.waypoints.clear();
  expectRefusal(answer<CheckPath>(in_frame_, request), "no waypoints");
}

TEST_F(CheckAnswers, TellWhatRaysHit) {
  auto request = makeRay();
  request.origins.push_back(point(0.55, 0.45, 0.55));
  request.directions.push_back(vector(1, 0, 0));
  auto response = answer<CastRays>(in_frame_, request);
  expectHead(response);
  EXPECT_EQ(response.end, (std::vector<std::uint8_t>{CastRays::Request::END_OCCUPIED,
                                                     CastRays::Request::END_UNKNOWN}));
  EXPECT_NEAR(response.distance[0], 0.45, 1e-9);
  expectNear(response.point[1], 2.0, 0.45, 0.55);
  EXPECT_EQ(response.first_unknown[0], INFINITY);
  EXPECT_NEAR(response.first_unknown[1], 1.45, 1e-9);

  request.unknown = CastRays::Request::UNKNOWN_FREE;
  response = answer<CastRays>(in_frame_, request);
  EXPECT_EQ(response.end[1], CastRays::Request::END_MAX_RANGE);
  EXPECT_NEAR(response.distance[1], 3.0, 1e-9);
  EXPECT_NEAR(response.unknown_length[1], 1.55, 1e-9);
  EXPECT_NEAR(response.first_unknown[1], 1.45, 1e-9);
}

TEST_F(CheckAnswers, MakeRaysAsThickAsTheirInflation) {
  auto request = makeRay();
  request.origins[0] = point(0.55, 0.45, 0.55);
  request.inflation = 0.1;
  EXPECT_EQ(answer<CastRays>(in_frame_, request).end[0], CastRays::Request::END_UNKNOWN);
  request.inflation = 0.2;  // Not through the door.
  const auto response = answer<CastRays>(in_frame_, request);
  EXPECT_EQ(response.end[0], CastRays::Request::END_OCCUPIED);
  EXPECT_NEAR(response.distance[0], 0.25, 1e-5);
}

TEST_F(CheckAnswers, RefuseWhatIsNoRay) {
  auto request = makeRay();
  request.directions[0] = vector(0, 0, 0);
  expectRefusal(answer<CastRays>(in_frame_, request), "directions[0]");
  request = makeRay();
  request.max_range = 0.0;
  expectRefusal(answer<CastRays>(in_frame_, request), "max_range");
  request.max_range = std::numeric_limits<double>::infinity();
  expectRefusal(answer<CastRays>(in_frame_, request), "must be a finite number greater than 0");
  request = makeRay();
  request.origins[0].y = std::nan("");
  expectRefusal(answer<CastRays>(in_frame_, request), "origins[0]");
  request = makeRay();
  request.directions.clear();
  expectRefusal(answer<CastRays>(in_frame_, request), "one of each for every ray");
}

TEST_F(CheckAnswers, HaveAnElementForEachEntryAlsoWhenRefused) {
  auto boxes = makeBoxes();
  boxes.inflation = -1.0;
  const auto no_boxes = answer<CheckBoxes>(in_frame_, boxes);
  expectRefusal(no_boxes, "inflation");
  EXPECT_EQ(no_boxes.blocked, (std::vector<std::uint8_t>{1, 1, 1}));
  EXPECT_EQ(no_boxes.max_probability.size(), 3U);
  auto path = makePath();
  path.lengths = {2, 1};
  path.header.frame_id = "nowhere";
  const auto no_path = answer<CheckPath>(in_frame_, path);
  expectRefusal(no_path, "nowhere");
  EXPECT_EQ(no_path.free, (std::vector<std::uint8_t>{0, 0}));
  EXPECT_EQ(no_path.point.size(), 2U);
  auto ray = makeRay();
  ray.max_range = NAN;
  const auto no_ray = answer<CastRays>(in_frame_, ray);
  expectRefusal(no_ray, "max_range");
  EXPECT_EQ(no_ray.end, (std::vector<std::uint8_t>{CastRays::Request::END_UNKNOWN}));
  EXPECT_EQ(no_ray.point.size(), 1U);
}

}  // namespace
}  // namespace cuboid_mapping_ros
