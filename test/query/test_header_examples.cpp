// SPDX-License-Identifier: BSD-3-Clause
// The examples at the begin of the headers of queries: compiled and run here, and compared with the headers.
#include "cuboid_mapping/boxes/box_cover.h"
#include "cuboid_mapping/boxes/free_boxes.h"
#include "cuboid_mapping/boxes/joined_cuboids.h"
#include "cuboid_mapping/query/answer.h"
#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/query/corridor_query.h"
#include "cuboid_mapping/query/cuboid_query.h"
#include "cuboid_mapping/query/distance_field.h"
#include "cuboid_mapping/query/fit_query.h"
#include "cuboid_mapping/query/frontier_query.h"
#include "cuboid_mapping/query/motion_query.h"
#include "cuboid_mapping/query/nearest_query.h"
#include "cuboid_mapping/query/obstacle_distance.h"
#include "cuboid_mapping/query/path_query.h"
#include "cuboid_mapping/query/point_query.h"
#include "cuboid_mapping/query/pose_path.h"
#include "cuboid_mapping/query/pose_query.h"
#include "cuboid_mapping/query/ray_query.h"
#include "cuboid_mapping/query/sphere_query.h"
#include "cuboid_mapping/query/value_query.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

namespace cuboid_mapping {
namespace {

/// A room of 4 x 2 x 1 m with a wall at x = 2 m that leaves a door from y = 1.2 m on.
class HeaderExamples : public testing::Test {
 protected:
  HeaderExamples() {
    map.replace(kAllCells, {{{{0, 0, 0}, {40, 20, 10}}, -1.0F}});
    const CellBox wall{{20, 0, 0}, {21, 12, 10}};
    map.replace(wall, {{wall, 1.0F}});
  }

  CuboidMap map{[] {
    MapConfig config;
    config.resolution_m = 0.1;
    return config;
  }()};
};

TEST_F(HeaderExamples, ofAnAnswer) {
  // Example of query/answer.h:
  Budget budget(QueryLimits{0.01});  // Seconds.
  const auto ray = castRay(map, {1, 1, 0.5}, {1, 0, 0}, 30.0, UnknownPolicy::kFree, budget);
  if (ray.isFound()) std::cout << ray->distance_m << " m\n";
  if (ray.status == AnswerStatus::kInvalid) std::cout << "wrong: " << ray.fault << '\n';
  if (ray.status == AnswerStatus::kBudgetSpent) std::cout << "not known after 10 ms\n";
  // End.
  EXPECT_TRUE(!ray.isFound() || std::abs(ray->distance_m - 1.0) < 1e-9);
}

TEST_F(HeaderExamples, ofABudget) {
  // Example of query/budget.h:
  Budget budget(QueryLimits{0.01});  // All queries that it is given to end after 10 ms.
  const Eigen::Vector3d size_m(0.4, 0.4, 0.4);
  const auto stop = UnknownPolicy::kObstacle;
  const bool is_free = isPathFree(map, {{0.5, 1, 0.5}, {1.5, 1, 0.5}}, size_m, stop, budget);
  if (!is_free && budget.isSpent()) std::cout << "not known after 10 ms\n";
  // End.
  EXPECT_TRUE(is_free || budget.isSpent());
}

TEST_F(HeaderExamples, ofABox) {
  // Example of query/box_query.h:
  Budget budget(QueryLimits{0.01});
  const auto box = queryBox(map, {{0.5, 0.5, 0.2}, {1.5, 1.5, 0.8}}, budget);  // Metres.
  if (box.isFound() && box->occupancy() == Occupancy::kFree) std::cout << "room to turn\n";
  const auto cells = queryCells(map, {{5, 5, 2}, {15, 15, 8}}, budget);  // Voxels.
  std::cout << cells.value.free_volume_m3 << " m3 are free\n";
  // End.
  EXPECT_NEAR(box.value.free_volume_m3, 0.6, 1e-9);
  EXPECT_EQ(cells.value.free_volume_m3, box.value.free_volume_m3);
}

TEST_F(HeaderExamples, ofACorridor) {
  // Example of query/corridor_query.h:
  CorridorTask task;
  task.start_map = {0.5, 0.5, 0.5};
  task.goal_map = {3.5, 0.5, 0.5};
  task.size_m = {0.5, 0.5, 0.5};
  task.clearance_m = 0.3;
  const auto way = findCorridor(map, task, UnknownPolicy::kObstacle, Budget::unlimited());
  if (way.isFound()) std::cout << way->boxes.size() << " boxes, " << way->length_m << " m\n";
  // End.
  ASSERT_TRUE(way.isFound());
  EXPECT_GT(way->length_m, 3.0);
}

TEST_F(HeaderExamples, ofCuboids) {
  // Example of query/cuboid_query.h:
  CuboidSelection selection;
  selection.filter = CuboidFilter::kOccupied;
  const auto walls = selectCuboids(map, kAllCells, selection, Budget::unlimited());
  for (const Cuboid& wall : walls.value) std::cout << wall.box << '\n';
  const auto graph = buildFreeGraph(map, kAllCells, {5, 5, 5}, Budget::unlimited());
  // End.
  EXPECT_TRUE(walls.isFound());
  EXPECT_GT(graph->portals.size(), 1U);
}

TEST_F(HeaderExamples, ofADistanceField) {
  // Example of query/distance_field.h:
  DistanceField field(map, {{0, 0, 0}, {40, 20, 10}}, 2.0, UnknownPolicy::kFree);
  std::cout << field.distanceAt({1.05, 0.5, 0.5}).value() << " m to the nearest obstacle\n";
  const CellBox pillar{{5, 5, 0}, {6, 6, 10}};
  field.update(map, map.replace(pillar, {{pillar, 1.0F}}));
  std::cout << field.distanceAt({1.05, 0.5, 0.5}).value() << " m after a change\n";
  // End.
  EXPECT_NEAR(field.distanceAt({1.05, 0.55, 0.5}).value(), 0.5, 1e-6);
}

TEST_F(HeaderExamples, ofAPlaceThatFits) {
  // Example of query/fit_query.h:
  Budget budget(QueryLimits{0.1});
  const Eigen::Vector3d size_m(0.5, 0.5, 0.5);
  const auto stop = UnknownPolicy::kObstacle;
  const auto place = findNearestFit(map, {2.0, 0.5, 0.5}, size_m, stop, 2.0, budget);
  if (place.isFound()) std::cout << "free at " << place->center_map.transpose() << '\n';
  // End.
  EXPECT_TRUE(budget.isSpent() || std::abs(place->center_map.x() - 1.75) < 1e-6);
}

TEST_F(HeaderExamples, ofFrontiers) {
  // Example of query/frontier_query.h:
  FrontierTask task;
  task.size_m = {0.4, 0.4, 0.4};
  const auto frontiers = findFrontiers(map, task, Budget::unlimited());
  for (const Frontier& frontier : frontiers.value) {
    std::cout << frontier.voxels.size() << " voxels\n";
  }
  // End.
  EXPECT_TRUE(frontiers.isFound());
}

TEST_F(HeaderExamples, ofAMotion) {
  // Example of query/motion_query.h:
  const Body base{{}, {{Eigen::Isometry3d::Identity(), {0.6, 0.4, 0.3}}}};
  const Eigen::Isometry3d from(Eigen::Translation3d(0.5, 0.5, 0.5));
  const Eigen::Isometry3d to(Eigen::Translation3d(3.5, 0.5, 0.5));
  Budget budget(QueryLimits{0.1});
  const auto contact = checkMotion(map, base, {from, to}, UnknownPolicy::kObstacle, budget);
  if (contact.isNotFound()) std::cout << "the way is free\n";
  // End.
  EXPECT_TRUE(budget.isSpent() || std::abs(contact->distance_m - 1.2) < 0.1);
}

TEST_F(HeaderExamples, ofTheNearestCuboids) {
  // Example of query/nearest_query.h:
  const Eigen::Vector3d point_map(1.0, 0.5, 0.5);
  const auto occupied = CuboidFilter::kOccupied;
  const auto nearest = findNearest(map, point_map, 3, occupied, Budget::unlimited());
  for (const NearestCuboid& near : nearest.value) std::cout << near.distance_m << " m\n";
  // End.
  EXPECT_NEAR(nearest->front().distance_m, 1.0, 1e-9);
}

TEST_F(HeaderExamples, ofAnObstaclesDistance) {
  // Example of query/obstacle_distance.h:
  Budget budget(QueryLimits{0.01});
  const auto free = UnknownPolicy::kFree;
  const auto obstacle = findObstacleDistance(map, {1.05, 0.5, 0.5}, 2.0, free, budget);
  if (obstacle.isFound()) std::cout << obstacle->distance_m << " m\n";
  if (obstacle.isNotFound()) std::cout << "more than 2 m\n";
  // End.
  EXPECT_TRUE(budget.isSpent() || std::abs(obstacle->distance_m - 1.0) < 1e-9);
}

TEST_F(HeaderExamples, ofAPath) {
  // Example of query/path_query.h:
  Budget budget(QueryLimits{0.01});
  const std::vector<Eigen::Vector3d> path{{0.5, 0.5, 0.5}, {3.5, 0.5, 0.5}};
  const auto contact = checkPath(map, path, {0.5, 0.5, 0.5}, UnknownPolicy::kObstacle, budget);
  if (contact.isNotFound()) std::cout << "free for " << lengthOf(path) << " m\n";
  if (contact.isFound()) std::cout << "blocked after " << contact->distance_m << " m\n";
  // End.
  EXPECT_TRUE(budget.isSpent() || std::abs(contact->distance_m - 1.25) < 1e-4);
}

TEST_F(HeaderExamples, ofAPoint) {
  // Example of query/point_query.h:
  const std::optional<Cuboid> cuboid = findCuboid(map, {1, 2, 3});  // Metres.
  const std::optional<Cuboid> of_cell = findCuboidOfCell(map, {1, 2, 3});
  if (!cuboid) std::cout << "unknown\n";
  if (of_cell) std::cout << "free from " << of_cell->box << '\n';
  // End.
  EXPECT_FALSE(cuboid);
  EXPECT_TRUE(of_cell);
}

TEST_F(HeaderExamples, ofAWayForABodyThatTurns) {
  // Example of query/pose_path.h:
  PosePathTask task;
  task.body.boxes.push_back({Eigen::Isometry3d::Identity(), {0.6, 0.4, 0.3}});
  task.start_map = Eigen::Translation3d(0.5, 0.5, 0.5);
  task.goal_map = Eigen::Translation3d(3.5, 0.5, 0.5);
  const auto path = findPosePath(map, task, UnknownPolicy::kObstacle, Budget::unlimited());
  if (path.isFound()) std::cout << path->T_map_body.size() << " poses\n";
  // End.
  ASSERT_TRUE(path.isFound());
  EXPECT_GT(path->length_m, 3.0);
}

TEST_F(HeaderExamples, ofPoses) {
  // Example of query/pose_query.h:
  const Body ball{{{Eigen::Vector3d::Zero(), 0.3}}, {}};  // Radius in metres.
  const std::vector<Eigen::Isometry3d> poses(1, Eigen::Isometry3d::Identity());
  Budget budget(QueryLimits{0.01});
  const auto contacts = checkPoses(map, ball, poses, UnknownPolicy::kObstacle, budget);
  if (contacts[0].isFound()) std::cout << "meets voxel " << contacts[0]->voxel << '\n';
  // End.
  EXPECT_TRUE(contacts[0].isFound());
}

TEST_F(HeaderExamples, ofARay) {
  // Example of query/ray_query.h:
  Budget budget(QueryLimits{0.01});
  const auto hit = findFirstHit(map, {1, 1, 0.5}, {1, 0, 0}, 30.0, budget);
  if (hit.isFound()) std::cout << "an obstacle after " << hit->distance_m << " m\n";
  if (hit.isNotFound()) std::cout << "nothing in 30 m\n";
  // End.
  EXPECT_TRUE(budget.isSpent() || std::abs(hit->distance_m - 1.0) < 1e-9);
}

TEST_F(HeaderExamples, ofSpheres) {
  // Example of query/sphere_query.h:
  SphereChecker arm(map, UnknownPolicy::kObstacle, Budget::unlimited());
  const auto answers = arm.check({{{0.5, 0.5, 0.5}, 0.2}, {{2, 1, 0.5}, 0.2}});
  if (answers[0] == AnswerStatus::kNotFound) std::cout << "the first ball is free\n";
  if (answers[1] == AnswerStatus::kFound) std::cout << "the second one meets an obstacle\n";
  // End.
  EXPECT_EQ(answers, (std::vector<AnswerStatus>{AnswerStatus::kNotFound, AnswerStatus::kFound}));
}

TEST_F(HeaderExamples, ofValues) {
  // Example of query/value_query.h:
  const CellBox box{{19, 0, 0}, {21, 1, 1}};
  const auto mean = meanProbability(map, box, Budget::unlimited());
  const auto greatest = maxLogOdds(map, box, Budget::unlimited());
  if (mean.isFound()) std::cout << *mean << " on average, " << *greatest << " at most\n";
  // End.
  EXPECT_NEAR(*mean, 0.5, 1e-6);
}

TEST_F(HeaderExamples, ofACover) {
  // Example of boxes/box_cover.h:
  CoverTask task;
  task.max_boxes = 10;
  task.keep_passages_m = {0.6, 0.6, 1.0};  // Doors stay open for this robot.
  const auto cover = coverOccupied(map, task, Budget::unlimited());
  if (cover.isNotFound()) std::cout << cover.value.boxes.size() << " boxes are needed\n";
  if (cover.isFound()) std::cout << cover->added_volume_m3 << " m3 more than the obstacles\n";
  // End.
  EXPECT_EQ(cover->added_volume_m3, 0.0);
}

TEST_F(HeaderExamples, ofFreeBoxes) {
  // Example of boxes/free_boxes.h:
  FreeBoxesTask task;
  task.max_boxes = 3;
  task.may_overlap = true;
  const auto free = findFreeBoxes(map, task, Budget::unlimited());
  for (const CellBox& box : free.value.boxes) std::cout << box << '\n';
  // End.
  EXPECT_EQ(free->boxes.size(), 3U);
}

TEST_F(HeaderExamples, ofJoinedCuboids) {
  // Example of boxes/joined_cuboids.h:
  const auto occupied = CuboidFilter::kOccupied;
  const auto walls = joinCuboids(map, kAllCells, occupied, Budget::unlimited());
  for (const Cuboid& wall : walls.value) std::cout << wall.box << '\n';
  // End.
  EXPECT_EQ(walls->size(), 1U);
}

std::vector<std::string> linesOf(const std::filesystem::path& file) {
  std::vector<std::string> lines;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// The lines after one, without their indentation, until one that does not begin with it.
std::vector<std::string> blockAfter(const std::vector<std::string>& lines, const std::string& first,
                                    const std::string& indent, const std::string& last) {
  std::vector<std::string> block;
  auto line = std::find(lines.begin(), lines.end(), first);
  for (; line != lines.end() && ++line != lines.end() && *line != last;) {
    if (line->compare(0, indent.size(), indent) != 0) break;
    block.push_back(line->substr(indent.size()));
  }
  return block;
}

TEST(HeadersOfQueries, BeginWithTheExamplesThatAreRunHere) {
  const std::filesystem::path source(CUBOID_MAPPING_SOURCE_DIR);
  const auto examples = linesOf(source / "test/query/test_header_examples.cpp");
  int num_headers = 0;
  for (const char* folder : {"query", "boxes"}) {
    for (const auto& entry :
         std::filesystem::directory_iterator(source / "include/cuboid_mapping" / folder)) {
      const std::string name = std::string(folder) + '/' + entry.path().filename().string();
      if (name == "query/unknown_policy.h") continue;  // One enum, used by all the others.
      const auto lines = linesOf(entry.path());
      ASSERT_GT(lines.size(), 2U);
      EXPECT_EQ(lines[1], "// Example:") << name;
      const auto shown = blockAfter(lines, "// Example:", "//     ", "");
      EXPECT_GE(shown.size(), 3U) << name;
      EXPECT_EQ(shown, blockAfter(examples, "  // Example of " + name + ":", "  ", "  // End."));
      ++num_headers;
    }
  }
  EXPECT_EQ(num_headers, 21);
}

}  // namespace
}  // namespace cuboid_mapping
