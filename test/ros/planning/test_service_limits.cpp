// SPDX-License-Identifier: BSD-3-Clause
// Every answer keeps within the limits, and reports omissions.
#include "cuboid_mapping/ros/edits/map_edits.h"
#include "cuboid_mapping/ros/planning/planner_services.h"

#include "ros/map_in_frame.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <thread>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::CastRays;
using cuboid_mapping::CheckBoxes;
using cuboid_mapping::CheckPath;
using cuboid_mapping::CheckPoses;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::FindCorridor;
using cuboid_mapping::FindNearest;
using cuboid_mapping::FindNearestFree;
using cuboid_mapping::GetCuboids;
using cuboid_mapping::GetDistances;
using cuboid_mapping::GetFreeGraph;
using cuboid_mapping::QueryBox;
using cuboid_mapping::SetBox;

class ServiceLimitsTest : public test::MapInFrameTest {
 protected:
  MapInFrame with(const ServiceLimits& limits) { return {map_, "map", tf_, limits, &is_stopped_}; }
  MapInFrame withBricks(int max_bricks) {
    ServiceLimits limits;
    limits.max_bricks = max_bricks;
    return with(limits);
  }
  MapInFrame withEntries(int max_entries) {
    ServiceLimits limits;
    limits.max_entries = max_entries;
    return with(limits);
  }

  /// The first entry is small, the second would take for ever.
  static CheckBoxes::Request makeBoxes() {
    CheckBoxes::Request request;
    request.boxes = {box({0.1, 0.1, 0.1}, {0.2, 0.2, 0.2}), box({0.1, 0.1, 0.1}, {1.9, 0.9, 0.9}),
                     box({0.1, 0.1, 0.1}, {0.2, 0.2, 0.2})};
    return request;
  }

  std::atomic<bool> is_stopped_{false};
};

template <typename ResponseT>
void expectCut(const ResponseT& response, const std::string& parameter) {
  const auto info = test::infoOf(response);
  EXPECT_TRUE(info.success);
  EXPECT_TRUE(info.truncated);
  EXPECT_NE(info.message.find(parameter), std::string::npos) << "says: " << info.message;
}

TEST_F(ServiceLimitsTest, LeaveBoxesBlockedThatAreNotAnswered) {
  const auto whole = answer<CheckBoxes>(in_frame_, makeBoxes());
  EXPECT_FALSE(whole.info.truncated);
  EXPECT_EQ(whole.info.answered, 3U);
  EXPECT_EQ(whole.info.message, "");
  EXPECT_EQ(whole.blocked, (std::vector<std::uint8_t>{0, 1, 0}));
  const auto cut = answer<CheckBoxes>(withBricks(6), makeBoxes());
  expectCut(cut, " bricks");
  EXPECT_NE(cut.info.message.find("1 of 3 boxes"), std::string::npos);
  EXPECT_EQ(cut.info.answered, 1U);
  EXPECT_EQ(cut.blocked, (std::vector<std::uint8_t>{0, 1, 1}));
  EXPECT_EQ(cut.occupancy[2], CheckBoxes::Response::UNKNOWN);
  EXPECT_TRUE(std::isnan(cut.max_probability[2]));
}

TEST_F(ServiceLimitsTest, LeavePathsBlockedThatAreNotAnswered) {
  CheckPath::Request request;
  request.waypoints = {point(0.5, 0.5, 0.5), point(-5000, 0, 0), point(0.5, 0.5, 0.5)};
  request.lengths = {1, 1, 1};
  request.size = vector(0.1, 0.1, 0.1);
  const auto modest = answer<CheckPath>(in_frame_, request);
  EXPECT_EQ(modest.info.answered, 3U);
  request.inflation = 4000.0;  // A box of 8 km.
  request.unknown = CheckPath::Request::UNKNOWN_FREE;
  request.waypoints = {point(-5000, 0, 0), point(0.5, 0.5, 0.5)};
  request.lengths = {1, 1};
  const auto cut = answer<CheckPath>(withBricks(100000), request);
  expectCut(cut, " bricks");
  EXPECT_NE(cut.info.message.find("0 of 2 paths are answered: ask for less, such as"),
            std::string::npos);
  EXPECT_EQ(cut.info.answered, 0U);
  EXPECT_EQ(cut.free, (std::vector<std::uint8_t>{0, 0}));
  EXPECT_EQ(cut.occupancy[0], CheckPath::Response::UNKNOWN);
  EXPECT_EQ(cut.point.size(), 2U);
}

TEST_F(ServiceLimitsTest, LetRaysEndAtOnceThatAreNotAnswered) {
  CastRays::Request request;
  request.origins = {point(0.5, 0.5, 0.5), point(0.5, 0.5, 0.5)};
  request.directions = {vector(1, 0, 0), vector(1, 0, 0)};
  request.max_range = 5e7;
  request.unknown = CastRays::Request::UNKNOWN_FREE;
  EXPECT_EQ(answer<CastRays>(in_frame_, request).info.answered, 2U)
      << "what is outside is passed at once";
  request.inflation = 100.0;
  const auto cut = answer<CastRays>(withBricks(100000), request);
  expectCut(cut, " bricks");
  EXPECT_EQ(cut.info.answered, 0U);
  EXPECT_EQ(cut.end, (std::vector<std::uint8_t>(2, CastRays::Request::END_UNKNOWN)));
  EXPECT_EQ(cut.distance, (std::vector<double>{0.0, 0.0}));
}

TEST_F(ServiceLimitsTest, TellNearestCuboidsOfWholePointsOnly) {
  FindNearest::Request request;
  request.points = {point(0.5, 0.5, 0.5), point(1.5, 0.5, 0.5)};
  request.classes = FindNearest::Request::ALL;
  request.k = 3;
  const auto whole = answer<FindNearest>(in_frame_, request);
  EXPECT_EQ(whole.counts, (std::vector<std::uint32_t>{3, 3}));
  const auto cut = answer<FindNearest>(withEntries(5), request);
  expectCut(cut, " entries and ");
  EXPECT_EQ(cut.info.answered, 1U);
  EXPECT_EQ(cut.counts, (std::vector<std::uint32_t>{3, 0}));
  EXPECT_EQ(cut.distance.size(), 3U);
  request.k = 0xFFFFFFFFU;
  EXPECT_TRUE(answer<FindNearest>(withEntries(5), request).info.truncated);
  EXPECT_FALSE(answer<FindNearest>(in_frame_, request).info.truncated) << "there are not so many";
}

TEST_F(ServiceLimitsTest, TellOfPlacesThatWereNotSearchedThatNoneIsFound) {
  FindNearestFree::Request request;
  request.points = {point(0.5, 0.5, 0.5), point(-1000, 0, 0)};
  request.size = vector(0.3, 0.3, 0.3);
  request.max_distance = 2000.0;
  const auto cut = answer<FindNearestFree>(withBricks(10), request);
  expectCut(cut, " bricks");
  EXPECT_EQ(cut.info.answered, 1U);
  EXPECT_EQ(cut.found, (std::vector<std::uint8_t>{1, 0}));
  EXPECT_TRUE(std::isinf(cut.distance[1]));
}

TEST_F(ServiceLimitsTest, CutCuboidsAndGraphs) {
  GetCuboids::Request cuboids;
  cuboids.everything = true;
  cuboids.classes = GetCuboids::Request::ALL;
  const std::size_t num_all = answer<GetCuboids>(in_frame_, cuboids).cuboids.size();
  const auto few = answer<GetCuboids>(withEntries(3), cuboids);
  expectCut(few, " entries and ");
  EXPECT_NE(few.info.message.find("smaller region"), std::string::npos);
  EXPECT_EQ(few.cuboids.size(), 3U);
  cuboids.limit = 2;
  const auto asked = answer<GetCuboids>(withEntries(3), cuboids);
  expectCut(asked, "more cuboids than limit");
  EXPECT_EQ(asked.cuboids.size(), 2U);
  cuboids.limit = 0;
  EXPECT_FALSE(answer<GetCuboids>(withEntries(static_cast<int>(num_all)), cuboids).info.truncated);

  GetFreeGraph::Request graph;
  graph.region = box({0, 0, 0}, {2, 1, 1});
  EXPECT_FALSE(answer<GetFreeGraph>(in_frame_, graph).info.truncated);
  expectCut(answer<GetFreeGraph>(withEntries(4), graph), " entries and ");
}

TEST_F(ServiceLimitsTest, LeaveOutCuboidsWhoseValuesAreNotRead) {
  GetCuboids::Request request;
  request.everything = true;
  request.classes = GetCuboids::Request::OCCUPIED;
  GetCuboids::Response cut;
  int max_bricks = 0;
  do {
    cut = answer<GetCuboids>(withBricks(++max_bricks), request);
    for (const MapCuboid& cuboid : cut.cuboids) EXPECT_GT(cuboid.probability, 0.5F) << max_bricks;
  } while (cut.info.truncated);
}

TEST_F(ServiceLimitsTest, CutTheCuboidsOfABox) {
  QueryBox::Request request;
  request.min = point(0, 0, 0);
  request.max = point(2, 1, 1);
  request.cuboids = QueryBox::Request::CUBOIDS_ALL;
  EXPECT_FALSE(answer<QueryBox>(in_frame_, request).truncated);
  const QueryBox::Response cut = answer<QueryBox>(withEntries(2), request);
  expectCut(cut, " entries and ");
  EXPECT_LE(cut.cuboids.size(), 2U);
  EXPECT_NEAR(cut.free_volume, 1.93, 1e-9) << "volumes were looked at before";
  const QueryBox::Response nothing = answer<QueryBox>(withBricks(1), request);
  EXPECT_EQ(nothing.occupancy, QueryBox::Response::UNKNOWN);
  expectCut(nothing, " bricks");
}

TEST_F(ServiceLimitsTest, EndTheSearchForACorridor) {
  FindCorridor::Request request;
  request.start = point(0.5, 0.8, 0.5);
  request.goal = point(1.5, 0.5, 0.5);
  request.size = vector(0.3, 0.3, 0.3);
  EXPECT_EQ(answer<FindCorridor>(in_frame_, request).result, FindCorridor::Response::FOUND);
  const auto cut = answer<FindCorridor>(withBricks(30), request);
  expectCut(cut, " bricks");
  EXPECT_EQ(cut.result, FindCorridor::Response::TIME_LIMIT);
  request.time_limit = 1e-9;
  const auto late = answer<FindCorridor>(in_frame_, request);
  expectCut(late, "its time_limit of 1e-09 s");
  EXPECT_EQ(late.result, FindCorridor::Response::TIME_LIMIT);
}

TEST_F(ServiceLimitsTest, RefuseRequestsWithTooManyEntries) {
  const MapInFrame map = withEntries(2);
  expectRefusal(answer<CheckBoxes>(map, makeBoxes()), "3 boxes in one request: at most 2");
  CheckPath::Request path;
  path.waypoints.resize(3);
  path.size = vector(1, 1, 1);
  expectRefusal(answer<CheckPath>(map, path), "3 waypoints");
  CastRays::Request rays;
  rays.max_range = 1.0;
  rays.origins.resize(3);
  expectRefusal(answer<CastRays>(map, rays), "3 rays");
  FindNearest::Request nearest;
  nearest.classes = FindNearest::Request::ALL;
  nearest.points.resize(3);
  expectRefusal(answer<FindNearest>(map, nearest), "3 points");
  FindNearestFree::Request places;
  places.points.resize(3);
  expectRefusal(answer<FindNearestFree>(map, places), "3 points");
  SetBox::Request boxes;
  boxes.boxes.resize(3);
  expectRefusal(answer<SetBox>(map, boxes), "3 boxes");
}

/// Answers that are refused because of the frame of the request.
class RefusedAnswers : public ServiceLimitsTest {
 protected:
  static constexpr std::size_t kNumEntries = 3;

  /// The answer to a request about a frame that tf does not have.
  template <typename ServiceT>
  typename ServiceT::Response refused(typename ServiceT::Request request) {
    request.header.frame_id = "nowhere";
    const auto response = answer<ServiceT>(in_frame_, request);
    expectRefusal(response, "nowhere");
    EXPECT_EQ(response.info.instance, map_.instance());
    EXPECT_EQ(response.info.revision, 1U);
    EXPECT_EQ(response.info.header.frame_id, "map");
    return response;
  }
  /// To a request about points.
  template <typename ServiceT>
  typename ServiceT::Response refusedPoints() {
    typename ServiceT::Request request;
    request.points.resize(kNumEntries);
    return refused<ServiceT>(request);
  }
};

TEST_F(RefusedAnswers, HaveAnElementForEachBoxPathPoseOrRayAndTheHeadOfTheMap) {
  const auto in_boxes = refused<CheckBoxes>(makeBoxes());
  EXPECT_EQ(in_boxes.blocked, std::vector<std::uint8_t>(kNumEntries, 1));
  EXPECT_EQ(in_boxes.occupancy.size(), kNumEntries);
  EXPECT_EQ(in_boxes.free_volume.size(), kNumEntries);
  EXPECT_EQ(in_boxes.occupied_volume.size(), kNumEntries);
  EXPECT_EQ(in_boxes.unknown_volume.size(), kNumEntries);
  EXPECT_EQ(in_boxes.max_probability.size(), kNumEntries);

  CheckPath::Request path;
  path.waypoints.resize(kNumEntries);
  path.headings.resize(kNumEntries);
  path.lengths.assign(kNumEntries, 1);
  const auto on_path = refused<CheckPath>(path);
  EXPECT_EQ(on_path.free, std::vector<std::uint8_t>(kNumEntries, 0));
  EXPECT_EQ(on_path.segment.size(), kNumEntries);
  EXPECT_EQ(on_path.point.size(), kNumEntries);
  EXPECT_EQ(on_path.occupancy.size(), kNumEntries);
  EXPECT_EQ(on_path.free_length, std::vector<double>(kNumEntries, 0.0));
  EXPECT_EQ(on_path.length.size(), kNumEntries);
  EXPECT_EQ(on_path.orientation.size(), kNumEntries);

  CheckPoses::Request poses;
  poses.poses.resize(kNumEntries);
  const auto at_poses = refused<CheckPoses>(poses);
  EXPECT_EQ(at_poses.free, std::vector<std::uint8_t>(kNumEntries, 0));
  EXPECT_EQ(at_poses.part.size(), kNumEntries);
  EXPECT_EQ(at_poses.point.size(), kNumEntries);
  EXPECT_EQ(at_poses.occupancy.size(), kNumEntries);

  CastRays::Request rays;
  rays.origins.resize(kNumEntries);
  const auto along_rays = refused<CastRays>(rays);
  EXPECT_EQ(along_rays.end, std::vector<std::uint8_t>(kNumEntries, CastRays::Request::END_UNKNOWN));
  EXPECT_EQ(along_rays.distance, std::vector<double>(kNumEntries, 0.0));
  EXPECT_EQ(along_rays.point.size(), kNumEntries);
  EXPECT_EQ(along_rays.first_unknown.size(), kNumEntries);
  EXPECT_EQ(along_rays.unknown_length.size(), kNumEntries);
}

TEST_F(RefusedAnswers, HaveAnElementForEachPointAndTheHeadOfTheMap) {
  const auto near_points = refusedPoints<FindNearest>();
  EXPECT_EQ(near_points.counts, std::vector<std::uint32_t>(kNumEntries, 0))
      << "no cuboids, so the other arrays are empty";

  const auto free_places = refusedPoints<FindNearestFree>();
  EXPECT_EQ(free_places.found, std::vector<std::uint8_t>(kNumEntries, 0));
  EXPECT_EQ(free_places.place.size(), kNumEntries);
  EXPECT_EQ(free_places.distance.size(), kNumEntries);

  const auto at_points = refusedPoints<GetDistances>();
  EXPECT_EQ(at_points.distance, std::vector<double>(kNumEntries, 0.0));
  EXPECT_EQ(at_points.gradient.size(), kNumEntries);
}

TEST_F(RefusedAnswers, HaveTheHeadOfTheMapWithoutEntriesToo) { (void)refused<FindCorridor>({}); }

TEST_F(ServiceLimitsTest, BoundTheBytesOfAnAnswerToo) {
  ServiceLimits limits;
  limits.max_answer_mb = 1;
  EXPECT_EQ(maxEntries(limits, 53), 18867U);
  limits.max_answer_mb = 900;
  EXPECT_EQ(maxEntries(limits, 53), 1000000U);
}

TEST_F(ServiceLimitsTest, SayThatTheNodeStops) {
  is_stopped_ = true;
  expectCut(answer<CheckBoxes>(with({}), makeBoxes()), "the node stops");
}

TEST_F(ServiceLimitsTest, AnswerWithValuesOfTheRevisionOfTheCuboids) {
  std::vector<cuboid_mapping::UniformBox> rods;  // None joins another.
  for (int x = 0; x < 1400; x += 2) {
    for (int y = 0; y < 1400; y += 2) rods.push_back({{{x, y, 0}, {x + 1, y + 1, 1}}, 1.0F});
  }
  map_.change(ros::Time(8.0),
              [&](CuboidMap& map) { return map.replace(cuboid_mapping::kAllCells, rods); });
  std::atomic<bool> is_done{false};
  std::thread others([&] {
    auto box = rods.back();
    while (!is_done) {
      box.log_odds = -box.log_odds;
      map_.edit([&](CuboidMap& map) { return map.replace(box.box, {box}); });
    }
  });
  const auto expect_occupied = [](const std::vector<MapCuboid>& cuboids) {
    EXPECT_TRUE(std::all_of(cuboids.begin(), cuboids.end(),
                            [](const MapCuboid& cuboid) { return cuboid.probability > 0.5F; }));
  };
  GetCuboids::Request all;
  all.classes = GetCuboids::Request::OCCUPIED;
  all.everything = 1;
  FindNearest::Request nearest;
  nearest.points = {point(30, 30, 0)};
  nearest.classes = FindNearest::Request::OCCUPIED;
  nearest.k = 490000;
  for (int i = 0; i < 5; ++i) {
    expect_occupied(answer<GetCuboids>(in_frame_, all).cuboids);
    expect_occupied(answer<FindNearest>(in_frame_, nearest).cuboids);
  }
  is_done = true;
  others.join();
}

TEST_F(ServiceLimitsTest, LetChangesInWhileALongQueryRuns) {
  cuboid_mapping::QueryLimits limits;
  limits.time_s = 30.0;  // In case nothing changes.
  std::atomic<bool> is_begun{false};
  std::thread cloud([&] {
    while (!is_begun) std::this_thread::yield();
    map_.change(ros::Time(8.0), [](CuboidMap& map) { return map.clear(); });
  });
  map_.readInTurns(limits, nullptr,
                   [&](const CuboidMap& map, const ros::Time& stamp, auto& budget) {
                     const std::uint64_t revision = map.revision();
                     is_begun = true;
                     while (map.revision() == revision && budget.spendAndUnlock()) {
                     }
                     EXPECT_GT(map.revision(), revision);
                     EXPECT_EQ(stamp, ros::Time(7.0)) << "of the beginning";
                   });
  cloud.join();
}

}  // namespace
}  // namespace cuboid_mapping_ros
