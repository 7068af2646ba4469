// SPDX-License-Identifier: BSD-3-Clause
// Answers of services about parts of the map that are on disk only, and conflicts of a window's parameters.
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/ros/edits/map_edits.h"
#include "cuboid_mapping/ros/map/map_storage.h"
#include "cuboid_mapping/ros/octomap_server/octomap_server_feature.h"
#include "cuboid_mapping/ros/parameters/parameters.h"
#include "cuboid_mapping/ros/planning/planner_services.h"
#include "ros/known_parameters.h"
#include "ros/map_in_frame.h"
#include "support/random_bricks.h"
#include "support/snapshots.h"
#include "tools/run_program.h"

#include <algorithm>
#include <atomic>
#include <functional>
#include <thread>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::BrickMask;
using cuboid_mapping::Cell;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::QueryBox;
using cuboid_mapping::ScanUpdate;
using cuboid_mapping::SetBox;

/// The room of MapInFrameTest, which is on disk, and a place 100 m away, in memory.
class WindowAnswers : public test::MapInFrameTest {
 protected:
  WindowAnswers() {
    NodeParameters parameters;
    parameters.map = makeConfig();
    parameters.window.frame_id = "base";
    parameters.window.config.size_m = 10.0;
    parameters.window.config.margin_m = 1.0;
    parameters.window.file = file_;
    map_.setWindow([&](CuboidMap& map) { return makeWindow(parameters, map); });
    goAway();
  }

  void goAway() {
    ScanUpdate update;
    update.bricks.push_back({{1000, 0, 0}, {}, BrickMask::all()});
    for (int i = 0; i < 30; ++i) {
      map_.integrate(ros::Time(7.0), update, cuboid_mapping::SensorModel(), {100.0, 0.0, 0.0});
    }
  }

  [[nodiscard]] std::size_t numOnDisk() const { return map_.windowFigures()->num_on_disk_only; }

  /// Asks about the room if that is refused, and if the room is loaded.
  template <typename ServiceT>
  typename ServiceT::Response ask(const typename ServiceT::Request& request) {
    EXPECT_EQ(numOnDisk(), 1U);
    expectRefusal(answer<ServiceT>(in_frame_, request), "not loaded: 1 part of the map");
    in_frame_.limits.outside = QueriesOutside::kLoad;
    const auto response = answer<ServiceT>(in_frame_, request);
    EXPECT_TRUE(test::infoOf(response).success) << test::infoOf(response).message;
    EXPECT_EQ(numOnDisk(), 0U);
    return response;
  }

  cuboid_mapping::test::TemporaryFolder folder_;
  std::string file_ = folder_ / "map.sqlite";
};

QueryBox::Request boxRequest(const Eigen::Vector3d& min, const Eigen::Vector3d& max) {
  QueryBox::Request request;
  request.min = toPoint(min);
  request.max = toPoint(max);
  return request;
}

TEST_F(WindowAnswers, OfABox) {
  const auto room = boxRequest({0.1, 0.1, 0.1}, {0.9, 0.9, 0.9});
  EXPECT_EQ(ask<QueryBox>(room).occupancy, QueryBox::Response::FREE);
  // Near the robot, answers are complete.
  goAway();
  in_frame_.limits.outside = QueriesOutside::kRefuse;
  const auto near = boxRequest({100.1, 0.1, 0.1}, {100.5, 0.5, 0.5});
  EXPECT_EQ(answer<QueryBox>(in_frame_, near).occupancy, QueryBox::Response::FREE);
}

TEST_F(WindowAnswers, OfBoxes) {
  cuboid_mapping::CheckBoxes::Request request;
  request.boxes = {box({0.1, 0.1, 0.1}, {0.9, 0.9, 0.9})};
  EXPECT_FALSE(ask<cuboid_mapping::CheckBoxes>(request).blocked[0]);
}

TEST_F(WindowAnswers, OfAPathThatPassesAPartOfWhichNoWaypointIsIn) {
  cuboid_mapping::CheckPath::Request request;
  request.waypoints = {point(-9.0, 0.45, 0.5), point(9.0, 0.45, 0.5)};
  request.size = vector(0.1, 0.1, 0.1);
  request.unknown = cuboid_mapping::CheckPath::Request::UNKNOWN_FREE;
  EXPECT_TRUE(ask<cuboid_mapping::CheckPath>(request).free[0]);  // Through the door.
}

TEST_F(WindowAnswers, OfRays) {
  cuboid_mapping::CastRays::Request request;
  request.origins = {point(-9.0, 0.1, 0.5)};
  request.directions = {vector(1.0, 0.0, 0.0)};
  request.max_range = 30.0;
  request.unknown = cuboid_mapping::CastRays::Request::UNKNOWN_FREE;
  EXPECT_NEAR(ask<cuboid_mapping::CastRays>(request).distance[0], 10.0, 1e-6);
}

TEST_F(WindowAnswers, OfTheNearestCuboidsAtAnyDistance) {
  cuboid_mapping::FindNearest::Request request;
  request.points = {point(99.0, 0.0, 0.0)};
  request.classes = cuboid_mapping::FindNearest::Request::OCCUPIED;
  request.k = 1;
  EXPECT_NEAR(ask<cuboid_mapping::FindNearest>(request).distance[0], 97.9, 0.1);
  goAway();
  in_frame_.limits.outside = QueriesOutside::kRefuse;
  request.max_distance = 20.0;
  EXPECT_EQ(answer<cuboid_mapping::FindNearest>(in_frame_, request).counts,
            std::vector<std::uint32_t>{0});
}

TEST_F(WindowAnswers, OfTheNearestPlace) {
  cuboid_mapping::FindNearestFree::Request request;
  request.points = {point(0.5, 0.5, 0.5)};
  request.size = vector(0.2, 0.2, 0.2);
  request.max_distance = 1.0;
  EXPECT_TRUE(ask<cuboid_mapping::FindNearestFree>(request).found[0]);
}

TEST_F(WindowAnswers, OfAllCuboids) {
  cuboid_mapping::GetCuboids::Request request;
  request.everything = 1;
  request.classes = cuboid_mapping::GetCuboids::Request::OCCUPIED;
  EXPECT_GT(ask<cuboid_mapping::GetCuboids>(request).cuboids.size(), 1U);
}

TEST_F(WindowAnswers, OfAGraph) {
  cuboid_mapping::GetFreeGraph::Request request;
  request.region = box({0.0, 0.0, 0.0}, {2.0, 1.0, 1.0});
  EXPECT_GT(ask<cuboid_mapping::GetFreeGraph>(request).cuboids.size(), 1U);
}

TEST_F(WindowAnswers, OfACorridorWhoseRegionIsTheWindowUnlessItIsGiven) {
  using cuboid_mapping::FindCorridor;
  FindCorridor::Request request;
  request.start = point(100.2, 0.2, 0.2);
  request.goal = point(100.6, 0.6, 0.6);
  request.size = vector(0.1, 0.1, 0.1);
  EXPECT_EQ(answer<FindCorridor>(in_frame_, request).result, FindCorridor::Response::FOUND);
  request.start = point(0.5, 0.5, 0.5);
  request.goal = point(1.5, 0.5, 0.5);
  EXPECT_EQ(ask<FindCorridor>(request).result, FindCorridor::Response::FOUND);
  goAway();
  in_frame_.limits.outside = QueriesOutside::kRefuse;
  request.use_region = 1;
  request.region = box({0.0, 0.0, 0.0}, {2.0, 1.0, 1.0});
  EXPECT_EQ(ask<FindCorridor>(request).result, FindCorridor::Response::FOUND);
}

TEST_F(WindowAnswers, RefuseMoreThanMayBeBroughtBack) {
  cuboid_mapping::GetCuboids::Request request;
  request.everything = 1;
  request.classes = cuboid_mapping::GetCuboids::Request::ALL;
  in_frame_.limits.outside = QueriesOutside::kLoad;
  in_frame_.limits.max_bricks = 500;
  expectRefusal(answer<cuboid_mapping::GetCuboids>(in_frame_, request),
                "more than a call may load");
}

TEST_F(WindowAnswers, RefuseMoreThanMayBeBroughtBackForAllBoxesOfARequest) {
  ScanUpdate update;
  update.bricks.push_back({{504, 0, 0}, {}, BrickMask::all()});
  map_.integrate(ros::Time(7.0), update, cuboid_mapping::SensorModel(), {50.0, 0.0, 0.0});
  goAway();
  ASSERT_EQ(numOnDisk(), 2U);
  in_frame_.limits.outside = QueriesOutside::kLoad;
  in_frame_.limits.max_bricks = 600;  // One part has 512.
  cuboid_mapping::CheckBoxes::Request request;
  request.boxes = {box({0.1, 0.1, 0.1}, {0.9, 0.9, 0.9}), box({50.5, 0.1, 0.1}, {50.9, 0.4, 0.4})};
  expectRefusal(answer<cuboid_mapping::CheckBoxes>(in_frame_, request),
                "more than a call may load");
  EXPECT_EQ(numOnDisk(), 1U);
  request.boxes.erase(request.boxes.begin());
  EXPECT_TRUE(answer<cuboid_mapping::CheckBoxes>(in_frame_, request).info.success);
}

TEST_F(WindowAnswers, WhatIsAskedAboutStaysUntilItIsAnswered) {
  in_frame_.limits.outside = QueriesOutside::kLoad;
  {
    ServiceCall call(in_frame_, {});
    (void)call.box(box({0.0, 0.0, 0.0}, {1.0, 1.0, 1.0}), 0.0, {"box"});
    goAway();
    EXPECT_EQ(numOnDisk(), 0U);
  }
  goAway();
  EXPECT_EQ(numOnDisk(), 1U);
}

TEST_F(WindowAnswers, OfAnOctreeAreWholeOrRefused) {
  const auto whole = [this](QueriesOutside outside, std::size_t max_bricks) {
    cuboid_mapping::SnapshotLimits limits;
    limits.max_bricks = max_bricks;
    in_frame_.limits.outside = outside;
    return viewWholeMap(in_frame_, limits);
  };
  constexpr std::size_t kMany = 1000;
  const auto refusal = [&](QueriesOutside outside, std::size_t max_bricks) -> std::string {
    try {
      (void)whole(outside, max_bricks);
    } catch (const std::runtime_error& refused) {
      return refused.what();
    }
    return "";
  };
  EXPECT_EQ(refusal(QueriesOutside::kRefuse, kMany).rfind("not loaded: 1 part of the map", 0), 0U);
  EXPECT_NE(refusal(QueriesOutside::kRefuse, kMany).find("window/queries"), std::string::npos);
  EXPECT_NE(refusal(QueriesOutside::kLoad, 2).find("the memory of this machine"),
            std::string::npos);
  const MapView view = whole(QueriesOutside::kLoad, kMany);
  EXPECT_EQ(numOnDisk(), 1U) << "it stays there";
  EXPECT_EQ(view.header.stamp, ros::Time(7.0));
  EXPECT_EQ(view.header.frame_id, "map");
  const auto voxels = cuboid_mapping::test::voxelsOf(view.map.bricks);
  EXPECT_EQ(voxels.count({0, 0, 0}), 1U);
  EXPECT_EQ(voxels.count({1000, 0, 0}), 1U);
  in_frame_.limits.outside = QueriesOutside::kLoad;
  EXPECT_TRUE(answer<QueryBox>(in_frame_, boxRequest({0.1, 0.1, 0.1}, {0.9, 0.9, 0.9})).success);
  EXPECT_EQ(refusal(QueriesOutside::kRefuse, 2), "") << "all of it is in memory now";
}

TEST_F(WindowAnswers, ReadNothingFromTheDiskWhenTheNodeEnds) {
  const std::atomic<bool> is_stopped{true};
  in_frame_.limits.outside = QueriesOutside::kLoad;
  in_frame_.is_stopped = &is_stopped;
  expectRefusal(answer<QueryBox>(in_frame_, boxRequest({0.1, 0.1, 0.1}, {0.9, 0.9, 0.9})),
                "not loaded: the node ends");
  EXPECT_EQ(numOnDisk(), 1U);
  EXPECT_THROW((void)viewWholeMap(in_frame_, {}), std::runtime_error);
}

TEST_F(WindowAnswers, CloudsGoOnWhileTheWholeMapIsReadFromTheDisk) {
  ScanUpdate update;
  for (int i = 0; i < 25; ++i) {
    update.bricks.push_back({{cuboid_mapping::kPageEdge * i, 640, 0}, {}, BrickMask::all()});
  }
  map_.integrate(ros::Time(7.0), update, cuboid_mapping::SensorModel(), {0.0, 0.0, 0.0});
  goAway();
  ASSERT_EQ(numOnDisk(), 26U);
  std::atomic<bool> is_begun{false};
  std::atomic<bool> is_done{false};
  std::thread changes([&] {
    for (float log_odds = 0.1F; !is_done; log_odds = -log_odds) {
      const cuboid_mapping::CellBox box{{1000, 0, 0}, {1001, 1, 1}};
      map_.editIn(box, [&](CuboidMap& map, const ros::Time&) {
        return map.replace(box, {cuboid_mapping::UniformBox{box, log_odds}});
      });
      is_begun = true;
    }
  });
  while (!is_begun) std::this_thread::yield();
  std::uint64_t num_changes = 0;
  cuboid_mapping::MapSnapshot snapshot;
  // On a busy machine the other thread may sleep during a snapshot.
  for (int i = 0; i < 100 && num_changes <= 3; ++i) {
    std::uint64_t revision = 0;
    snapshot = takeWholeSnapshot(
        map_, "map", {},
        [&](const CuboidMap& map, const ros::Time&, const auto*) { revision = map.revision(); });
    num_changes =
        map_.read([](const CuboidMap& map, const ros::Time&) { return map.revision(); }) - revision;
  }
  is_done = true;
  changes.join();
  EXPECT_GT(num_changes, 3U);
  EXPECT_EQ(cuboid_mapping::test::voxelsOf(snapshot.bricks).count({24 * 64, 640, 0}), 1U);
}

std::map<Cell, float> voxelsOfSaved(GuardedMap& map, const std::string& file) {
  const StorageAnswer answer = saveMap(map, "map", file);
  EXPECT_EQ(answer.error, "");
  return cuboid_mapping::test::voxelsOf(cuboid_mapping::readMapFile(file).snapshot.bricks);
}

TEST_F(WindowAnswers, EditsAreMadeInAPartThatIsOnDisk) {
  const std::map<Cell, float> before = voxelsOfSaved(map_, folder_ / "before.cuboids");
  EXPECT_EQ(numOnDisk(), 1U);  // Saving does not load it.
  SetBox::Request request;
  request.occupancy = SetBox::Request::OCCUPIED;
  request.boxes = {box({0.3, 0.3, 0.3}, {0.5, 0.5, 0.5})};
  ask<SetBox>(request);
  goAway();
  EXPECT_EQ(numOnDisk(), 1U);
  const cuboid_mapping::MetricBox corner{{0.0, 0.0, 0.0}, {0.2, 0.2, 0.2}};
  in_frame_.limits.outside = QueriesOutside::kRefuse;
  EXPECT_EQ(clearBox(in_frame_, corner).rfind("not loaded: 1 part of the map", 0), 0U);
  in_frame_.limits.outside = QueriesOutside::kLoad;
  EXPECT_EQ(clearBox(in_frame_, corner), "");
  goAway();
  std::map<Cell, float> expected = before;
  const auto set = [&](const cuboid_mapping::CellBox& box, float value) {
    cuboid_mapping::test::visitCells(box, [&](const Cell& cell) { expected[cell] = value; });
  };
  const cuboid_mapping::SensorModel model;
  set({{3, 3, 3}, {5, 5, 5}}, model.max());
  set({{0, 0, 0}, {2, 2, 2}}, model.min());
  EXPECT_EQ(voxelsOfSaved(map_, folder_ / "after.cuboids"), expected);
  EXPECT_EQ(numOnDisk(), 1U);
  EXPECT_EQ(undoEdit(map_).message, "undone; 1 more can be undone");
  goAway();
  EXPECT_TRUE(undoEdit(map_).success);
  goAway();
  EXPECT_EQ(voxelsOfSaved(map_, folder_ / "undone.cuboids"), before);
}

TEST_F(WindowAnswers, AFileIsPutInTheMapAndInThePlaceOfIt) {
  const std::string file = folder_ / "file.cuboids";
  std::map<Cell, float> expected = voxelsOfSaved(map_, file);
  const cuboid_mapping::SensorModel model;
  std::map<Cell, float> clamped = expected;  // The voxels after mergeMaps().
  for (auto& [cell, value] : clamped) value = std::max(value, model.min());
  SetBox::Request request;
  request.occupancy = SetBox::Request::UNKNOWN;
  request.boxes = {box({0.0, 0.0, 0.0}, {0.5, 1.0, 1.0})};
  ask<SetBox>(request);
  goAway();
  // For voxels known to both, the later one counts: all from the file.
  EXPECT_EQ(loadMap(map_, file, {}, {cuboid_mapping::MergeRule::kLater, std::nullopt, ""}).error,
            "");
  goAway();
  EXPECT_EQ(voxelsOfSaved(map_, folder_ / "merged.cuboids"), clamped);
  request.occupancy = SetBox::Request::FREE;
  EXPECT_TRUE(answer<SetBox>(in_frame_, request).info.success);
  EXPECT_EQ(loadMap(map_, file).error, "");
  goAway();
  EXPECT_EQ(numOnDisk(), 1U);
  // Thirty more clouds have seen the remote place.
  std::map<Cell, float> loaded = voxelsOfSaved(map_, folder_ / "loaded.cuboids");
  for (auto* voxels : {&expected, &loaded})
    voxels->erase(voxels->lower_bound({999, 0, 0}), voxels->end());
  EXPECT_EQ(loaded, expected);
}

TEST_F(WindowAnswers, AMapIsMovedWithWhatIsOnDisk) {
  const std::map<Cell, float> before = voxelsOfSaved(map_, folder_ / "before.cuboids");
  const double resolution_m = map_.grid().resolution();
  const Eigen::Isometry3d T_new_old(Eigen::Translation3d(resolution_m * 3.0, 0.0, 0.0));
  const auto motion = cuboid_mapping::VoxelMotion::of(T_new_old, resolution_m);
  cuboid_mapping::SnapshotLimits limits;
  limits.max_bricks = 1;
  EXPECT_NE(moveWholeMap(map_, *motion, limits).error.find("the memory of this machine"),
            std::string::npos);
  EXPECT_EQ(voxelsOfSaved(map_, folder_ / "refused.cuboids"), before);
  ASSERT_EQ(numOnDisk(), 1U);
  EXPECT_EQ(moveWholeMap(map_, *motion).error, "");
  std::map<Cell, float> expected;
  for (const auto& [cell, value] : before) expected[cell + Cell{3, 0, 0}] = value;
  EXPECT_EQ(voxelsOfSaved(map_, folder_ / "after.cuboids"), expected);
  // The file has the new frame at once: a killed node continues there.
  map_.setWindow([](CuboidMap& /*map*/) { return nullptr; });
  EXPECT_EQ(cuboid_mapping::test::voxelsOf(cuboid_mapping::readMapFile(file_).snapshot.bricks),
            expected);
}

std::vector<std::string> errorsOf(const std::function<void(XmlRpc::XmlRpcValue&)>& change) {
  XmlRpc::XmlRpcValue group;
  group["window"]["frame"] = "base";
  group["window"]["file"] = "map.sqlite";
  change(group);
  std::vector<std::string> keys;
  for (const ParameterError& error : readParameters(group).errors) keys.push_back(error.key);
  return keys;
}

TEST(WindowParameters, GoTogether) {
  using Keys = std::vector<std::string>;
  using XmlRpc::XmlRpcValue;
  EXPECT_EQ(errorsOf([](XmlRpcValue&) {}), Keys{});
  EXPECT_EQ(errorsOf([](XmlRpcValue& group) { group["window"]["file"] = ""; }),
            Keys{"window/file"});
  EXPECT_EQ(errorsOf([](XmlRpcValue& group) { group["window"]["outside"] = "forget"; }),
            Keys{"window/file"});
  EXPECT_EQ(errorsOf([](XmlRpcValue& group) { group["map_file"] = "a.cuboids"; }),
            Keys{"map_file"});
}

TEST(WindowParameters, DoNotGoWithForgettingOrRobots) {
  if (!test::hasParameters({"forget_after", "merge/robots"})) GTEST_SKIP();
  using Keys = std::vector<std::string>;
  using XmlRpc::XmlRpcValue;
  EXPECT_EQ(errorsOf([](XmlRpcValue& group) { group["forget_after"] = 10.0; }),
            Keys{"forget_after"});
  EXPECT_EQ(errorsOf([](XmlRpcValue& group) {
              group["sources"].setSize(1);
              group["sources"][0]["topic"] = "/points";
              group["sources"][0]["forget_after"] = 10.0;
            }),
            Keys{"sources[0]/forget_after"});
  EXPECT_EQ(errorsOf([](XmlRpcValue& group) { group["merge"]["robots"] = "/a"; }),
            Keys{"window/frame"});
  EXPECT_EQ(errorsOf([](XmlRpcValue& group) {
              group["window"]["outside"] = "forget";
              group["window"]["file"] = "";
              group["forget_after"] = 10.0;
            }),
            Keys{});
  EXPECT_EQ(errorsOf([](XmlRpcValue& group) {
              group["window"]["frame"] = "";
              group["forget_after"] = 10.0;
            }),
            Keys{});
}

}  // namespace
}  // namespace cuboid_mapping_ros
