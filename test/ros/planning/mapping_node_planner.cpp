// SPDX-License-Identifier: BSD-3-Clause
// The running node: questions of planners in a known room; edits and ~pause.
#include "cuboid_mapping/CastRays.h"
#include "cuboid_mapping/CheckBoxes.h"
#include "cuboid_mapping/CheckPath.h"
#include "cuboid_mapping/FindCorridor.h"
#include "cuboid_mapping/FindNearest.h"
#include "cuboid_mapping/FindNearestFree.h"
#include "cuboid_mapping/GetCuboids.h"
#include "cuboid_mapping/GetFreeGraph.h"
#include "cuboid_mapping/GetLocks.h"
#include "cuboid_mapping/SetBox.h"
#include "cuboid_mapping/ros/queries/service_call.h"
#include "ros/node_probe.h"

#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>

#include <cmath>
#include <string>
#include <vector>

namespace cuboid_mapping_ros::test {
namespace {

using namespace cuboid_mapping;  // NOLINT(google-build-using-namespace): services of one package

/// A room of 4 x 4 x 2 m around the origin of the map, its walls one voxel thick, seen once.
class NodePlannerTest : public NodeTest {
 protected:
  void SetUp() override {
    NodeTest::SetUp();
    publishStaticTf(makeTransform("map", "lidar", makeTranslation(0.05, 0.05, 0.05)));
    sendRoom(101.5);
    ASSERT_TRUE(waitForInserted(1));
  }

  void sendRoom(double stamp_s) {
    std::vector<Eigen::Vector3d> points = makeRoom({2.0, 2.0, 1.0});
    for (Eigen::Vector3d& point : points) point -= Eigen::Vector3d(0.05, 0.05, 0.05);
    cloud_publisher_.publish(makeCloud("lidar", ros::Time(stamp_s), points));
  }

  template <typename ServiceT>
  static void ask(const std::string& name, ServiceT& service) {
    ASSERT_TRUE(callService(std::string(kNode) + "/" + name, service));
    EXPECT_TRUE(service.response.info.success) << name << ": " << service.response.info.message;
    EXPECT_EQ(service.response.info.header.frame_id, "map");
    EXPECT_EQ(service.response.info.header.stamp, ros::Time(101.5));
    EXPECT_GT(service.response.info.revision, 0U);
  }
  static double freeVolume() {
    CheckBoxes boxes;
    boxes.request.boxes.emplace_back();
    boxes.request.boxes.back().min = toPoint({-3, -3, -3});
    boxes.request.boxes.back().max = toPoint({3, 3, 3});
    EXPECT_TRUE(callService(std::string(kNode) + "/check_boxes", boxes));
    return boxes.response.free_volume.at(0);
  }
};

TEST_F(NodePlannerTest, AnswersEveryQuestion) {
  EXPECT_NEAR(freeVolume(), 32.0, 0.2);

  CheckPath path;
  path.request.waypoints = {toPoint({-1.5, 0, 0}), toPoint({3, 0, 0})};
  path.request.size = toVector3({0.5, 0.5, 0.5});
  ask("check_path", path);
  EXPECT_NEAR(path.response.point.at(0).x, 1.75, 0.11);

  CastRays rays;
  rays.request.origins = {toPoint({0, 0, 0})};
  rays.request.directions = {toVector3({0, 1, 0})};
  rays.request.max_range = 10.0;
  ask("cast_rays", rays);
  EXPECT_NEAR(rays.response.distance.at(0), 2.0, 0.11);
  EXPECT_EQ(rays.response.end.at(0), CastRays::Request::END_OCCUPIED);

  FindNearest nearest;
  nearest.request.points = {toPoint({1.5, 0, 0})};
  nearest.request.classes = FindNearest::Request::OCCUPIED;
  nearest.request.k = 1;
  ask("nearest", nearest);
  EXPECT_NEAR(nearest.response.distance.at(0), 0.5, 0.11);

  FindNearestFree place;
  place.request.points = {toPoint({2.2, 0, 0})};
  place.request.size = toVector3({0.5, 0.5, 0.5});
  place.request.max_distance = 3.0;
  ask("nearest_free", place);
  EXPECT_NEAR(place.response.place.at(0).x, 1.75, 0.11);

  GetCuboids cuboids;
  cuboids.request.everything = true;
  cuboids.request.classes = GetCuboids::Request::OCCUPIED;
  ask("get_cuboids", cuboids);
  EXPECT_GT(cuboids.response.cuboids.size(), 50U);

  GetFreeGraph graph;
  graph.request.region.min = toPoint({-2, -2, -1});
  graph.request.region.max = toPoint({2, 2, 1});
  graph.request.size = toVector3({0.5, 0.5, 0.5});
  ask("get_free_graph", graph);
  EXPECT_GT(graph.response.first.size(), 10U);

  FindCorridor corridor;
  corridor.request.start = toPoint({-1.5, -1.5, 0});
  corridor.request.goal = toPoint({1.5, 1.5, 0});
  corridor.request.size = toVector3({0.5, 0.5, 0.5});
  ask("find_corridor", corridor);
  EXPECT_EQ(corridor.response.result, FindCorridor::Response::FOUND);
  EXPECT_EQ(corridor.response.boxes.size(), 1U) << "the room is one box";
}

TEST_F(NodePlannerTest, TurnsABaseThroughADoor) {
  SetBox wall;  // At x = 0, with a door of 0.8 m.
  wall.request.boxes.resize(2);
  wall.request.boxes[0].min = toPoint({0, -2, -1});
  wall.request.boxes[0].max = toPoint({0.1, -0.4, 1});
  wall.request.boxes[1].min = toPoint({0, 0.4, -1});
  wall.request.boxes[1].max = toPoint({0.1, 2, 1});
  wall.request.occupancy = SetBox::Request::OCCUPIED;
  ask("set_box", wall);
  FindCorridor way;
  way.request.start = toPoint({-1.2, 0.5, 0});
  way.request.goal = toPoint({1.2, 0.5, 0});
  way.request.size = toVector3({1.0, 0.6, 0.3});
  way.request.headings = {M_PI / 2, M_PI / 2};
  ask("find_corridor", way);
  ASSERT_EQ(way.response.result, FindCorridor::Response::FOUND);
  CheckPath path;
  path.request.size = way.request.size;
  for (const auto& pose : way.response.path.poses) {
    path.request.waypoints.push_back(pose.pose.position);
    path.request.headings.push_back(2.0 *
                                    std::atan2(pose.pose.orientation.z, pose.pose.orientation.w));
  }
  ask("check_path", path);
  EXPECT_TRUE(path.response.free.at(0));
  path.request.waypoints = {way.request.start, way.request.goal};
  path.request.headings = way.request.headings;
  ask("check_path", path);
  EXPECT_FALSE(path.response.free.at(0)) << "straight, across";
}

TEST_F(NodePlannerTest, SetsLocksAndUndoesABox) {
  const double free_m3 = freeVolume();
  SetBox box;
  box.request.boxes.emplace_back();
  box.request.boxes.back().min = toPoint({-0.5, -0.5, -0.5});
  box.request.boxes.back().max = toPoint({0.5, 0.5, 0.5});
  box.request.occupancy = SetBox::Request::OCCUPIED;
  box.request.lock = true;
  ask("set_box", box);
  EXPECT_NEAR(freeVolume(), free_m3 - 1.0, 1e-6);
  for (int i = 0; i < 8; ++i) {
    sendRoom(102.0 + i);
    ASSERT_TRUE(waitForInserted(i + 2));
  }
  EXPECT_NEAR(freeVolume(), free_m3 - 1.0, 1e-6) << "clouds do not change what is locked";

  GetLocks locks;
  ASSERT_TRUE(callService(std::string(kNode) + "/get_locks", locks));
  EXPECT_TRUE(locks.response.info.success);
  ASSERT_EQ(locks.response.boxes.size(), 1U);
  EXPECT_NEAR(locks.response.boxes[0].max.x, 0.5, 1e-9);
  std_srvs::Trigger undo;
  ASSERT_TRUE(callService(std::string(kNode) + "/undo_edit", undo));
  EXPECT_TRUE(undo.response.success) << undo.response.message;
  EXPECT_NEAR(freeVolume(), free_m3, 1e-6);
  ASSERT_TRUE(callService(std::string(kNode) + "/get_locks", locks));
  EXPECT_TRUE(locks.response.boxes.empty());
  ASSERT_TRUE(callService(std::string(kNode) + "/undo_edit", undo));
  EXPECT_FALSE(undo.response.success);
}

TEST_F(NodePlannerTest, LeavesCloudsOutWhilePaused) {
  std_srvs::SetBool pause;
  pause.request.data = true;
  EXPECT_TRUE(callService(std::string(kNode) + "/pause", pause));
  sendRoom(102.5);
  EXPECT_TRUE(waitFor([this] { return countNew("clouds dropped, paused") == 1; }));
  pause.request.data = false;
  EXPECT_TRUE(callService(std::string(kNode) + "/pause", pause));
  sendRoom(103.5);
  EXPECT_TRUE(waitForInserted(2));
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
