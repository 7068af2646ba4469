// SPDX-License-Identifier: BSD-3-Clause
// Queries with a budget: they end soon, and report it; with a large budget they answer as without one.
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/query/budget.h"
#include "cuboid_mapping/query/corridor_query.h"
#include "cuboid_mapping/query/cuboid_query.h"
#include "cuboid_mapping/query/fit_query.h"
#include "cuboid_mapping/query/frontier_query.h"
#include "cuboid_mapping/query/nearest_query.h"
#include "cuboid_mapping/query/path_query.h"
#include "cuboid_mapping/query/pose_path.h"
#include "cuboid_mapping/query/ray_query.h"
#include "cuboid_mapping/query/value_query.h"
#include "support/bodies.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace cuboid_mapping {
namespace {

constexpr double kForever_s = std::numeric_limits<double>::infinity();

/// A map of a room of 40 m with a wall and a door, at 1 m, and a far voxel: its bounds reach 1000 km.
CuboidMap makeMap() {
  MapConfig config;
  config.resolution_m = 1.0;
  CuboidMap map(config);
  map.replace(kAllCells, {{{{0, 0, 0}, {20, 40, 40}}, -1.0F},
                          {{{20, 0, 0}, {21, 30, 40}}, 1.0F},
                          {{{20, 30, 0}, {21, 40, 40}}, -1.0F},
                          {{{21, 0, 0}, {40, 40, 40}}, -1.0F},
                          {{{1000000, 1000000, 1000000}, {1000001, 1000001, 1000001}}, 1.0F}});
  return map;
}

const CellBox kRoom{{0, 0, 0}, {40, 40, 40}};
constexpr double kFar_m = 5e5;

/// A question with its answer as a text, so that answers can be compared.
struct Question {
  std::string name;
  std::function<std::string(const CuboidMap&, Budget&)> ask;
};

CorridorTask throughTheDoor() {
  CorridorTask task;
  task.start_map = {5, 5, 5};
  task.goal_map = {35, 5, 5};
  task.size_m = {3, 3, 3};
  return task;
}

PosePathTask turningTask(const Eigen::Vector3d& start, const Eigen::Vector3d& goal,
                         const Eigen::Vector3d& size_m) {
  PosePathTask task;
  task.body = test::boxBody(size_m);
  task.start_map = test::yawed(start, 0.1);
  task.goal_map = test::yawed(goal, 1.0);
  return task;
}

/// Questions about the content of the map.
std::vector<Question> modestQuestions() {
  return {
      {"box",
       [](const CuboidMap& map, Budget& budget) {
         return std::to_string(queryCells(map, kRoom, budget).value.free_volume_m3);
       }},
      {"greatest log-odds",
       [](const CuboidMap& map, Budget& budget) {
         return std::to_string(maxLogOdds(map, kRoom, budget).valueOr(99.0F));
       }},
      {"mean probability",
       [](const CuboidMap& map, Budget& budget) {
         return std::to_string(meanProbability(map, kRoom, budget).valueOr(99.0));
       }},
      {"ray",
       [](const CuboidMap& map, Budget& budget) {
         const auto ray = castRay(map, {1, 1, 1}, {1, 0.1, 0.2}, 100, UnknownPolicy::kFree, budget);
         return ray.isFound() ? std::to_string(ray->distance_m) : "none";
       }},
      {"first hit",
       [](const CuboidMap& map, Budget& budget) {
         const auto ray = findFirstHit(map, {1, 1, 1}, {1, 0.1, 0.2}, 100, budget);
         return ray.isFound() ? std::to_string(ray->distance_m) : "none";
       }},
      {"path", [](const CuboidMap& map, Budget& budget) {
         const auto path = checkPath(map, {{5, 5, 5}, {15, 15, 15}, {35, 15, 15}}, {3, 3, 3},
                                     UnknownPolicy::kObstacle, budget);
         return path.isFound() ? std::to_string(path->distance_m) : "none";
       }}};
}

/// Questions about near objects, or answered by a search.
std::vector<Question> modestSearches() {
  return {
      {"nearest",
       [](const CuboidMap& map, Budget& budget) {
         std::string text;
         const auto nearest = findNearest(map, {10, 10, 10}, 30, CuboidFilter::kAll, budget, 1e9);
         for (const auto& near : nearest.value) {
           text += std::to_string(near.distance_m) + ' ';
         }
         return text;
       }},
      {"nearest place",
       [](const CuboidMap& map, Budget& budget) {
         const auto place =
             findNearestFit(map, {20, 5, 5}, {3, 3, 3}, UnknownPolicy::kObstacle, 20, budget);
         return place.isFound() ? toText(place->center_map) : "none";
       }},
      {"cuboids",
       [](const CuboidMap& map, Budget& budget) {
         return std::to_string(selectCuboids(map, kRoom, {}, budget).value.size());
       }},
      {"free graph",
       [](const CuboidMap& map, Budget& budget) {
         const FreeGraph graph = buildFreeGraph(map, kRoom, {1, 1, 1}, budget, 1000000).value;
         return std::to_string(graph.cuboids.size()) + ' ' + std::to_string(graph.portals.size());
       }},
      {"corridor",
       [](const CuboidMap& map, Budget& budget) {
         const auto corridor =
             findCorridor(map, throughTheDoor(), UnknownPolicy::kObstacle, budget);
         std::string text = std::to_string(static_cast<int>(corridor.status));
         for (const auto& point : corridor.value.path_map) text += ", " + toText(point);
         return text;
       }},
      {"way of a robot that turns", [](const CuboidMap& map, Budget& budget) {
         const auto task = turningTask({5, 25, 5}, {35, 25, 5}, {5, 3, 3});
         return std::to_string(
             findPosePath(map, task, UnknownPolicy::kObstacle, budget).value.length_m);
       }}};
}

TEST(QueriesWithABudget, answerAsWithoutOneUnlessItIsSpent) {
  const CuboidMap map = makeMap();
  std::vector<Question> questions = modestQuestions();
  for (Question& search : modestSearches()) questions.push_back(std::move(search));
  for (const Question& question : questions) {
    const std::string expected = question.ask(map, Budget::unlimited());
    EXPECT_NE(expected, "none") << question.name;
    int num_spent = 0;
    bool is_answered = false;
    for (std::uint64_t count = 0; count < 4000000 && !is_answered; count = 2 * count + 1) {
      Budget budget(QueryLimits{kForever_s, count});
      const std::string answer = question.ask(map, budget);
      num_spent += budget.isSpent() ? 1 : 0;
      is_answered = !budget.isSpent();
      if (is_answered) {
        EXPECT_EQ(answer, expected) << question.name << " with " << count;
      }
    }
    EXPECT_TRUE(is_answered) << question.name;
    EXPECT_GT(num_spent, 0) << question.name << " looks at no budget";
  }
}

TEST(QueriesWithABudget, giveNoAnswerThatWasCutForAWholeOne) {
  const CuboidMap map = makeMap();
  Budget budget(QueryLimits{kForever_s, 1});
  const auto is_spent = [](const auto& answer) {
    return answer.status == AnswerStatus::kBudgetSpent;
  };
  const auto policy = UnknownPolicy::kObstacle;
  EXPECT_TRUE(is_spent(castRay(map, {1, 1, 1}, {1, 0.1, 0.2}, 100, UnknownPolicy::kFree, budget)));
  EXPECT_TRUE(budget.isSpent());
  EXPECT_TRUE(is_spent(checkPath(map, {{5, 5, 5}, {15, 15, 15}}, {3, 3, 3}, policy, budget)));
  EXPECT_TRUE(is_spent(findFirstHit(map, {1, 1, 1}, {1, 0.1, 0.2}, 100, budget)));
  EXPECT_FALSE(isFree(map, {{5, 5, 5}, {6, 6, 6}}, UnknownPolicy::kFree, budget));
  EXPECT_TRUE(is_spent(findNearestFit(map, {5, 5, 5}, {3, 3, 3}, policy, 20, budget)));
  EXPECT_TRUE(is_spent(findNearest(map, {5, 5, 5}, 1, CuboidFilter::kAll, budget)));
  EXPECT_TRUE(is_spent(maxLogOdds(map, kRoom, budget)));
  EXPECT_TRUE(is_spent(meanProbability(map, kRoom, budget)));
  EXPECT_TRUE(is_spent(selectCuboids(map, kRoom, {}, budget)));
  EXPECT_TRUE(is_spent(buildFreeGraph(map, kRoom, {1, 1, 1}, budget, 1000000)));
  EXPECT_TRUE(is_spent(findCorridor(map, throughTheDoor(), policy, budget)));
  const auto spent = queryCells(map, kRoom, budget);
  EXPECT_TRUE(is_spent(spent));
  const BoxQueryResult& box = spent.value;
  EXPECT_EQ(box.occupancy(), Occupancy::kUnknown) << "what was not looked at is not free";
  EXPECT_EQ(box.unknown_volume_m3, 64000.0);
}

TEST(QueriesWithABudget, spendItWhileTheyReadNotBefore) {
  const CuboidMap map = makeMap();
  const std::uint64_t num_bricks = map.voxels().size();
  Budget half(QueryLimits{kForever_s, num_bricks / 2});
  const auto box = queryCells(map, kRoom, half);
  EXPECT_EQ(box.status, AnswerStatus::kBudgetSpent);
  EXPECT_LT(box.value.unknown_volume_m3, 64000.0);
  Budget marks(QueryLimits{kForever_s, 7 * num_bricks});
  EXPECT_EQ(findFrontiers(map, {}, marks).status, AnswerStatus::kBudgetSpent) << "clusters cost";
}

TEST(QueriesWithABudget, countTheEntriesOfTheirAnswers) {
  const CuboidMap map = makeMap();
  QueryLimits limits;
  limits.max_entries = 7;
  const auto count = [&](auto ask) {
    Budget budget(limits);
    const std::size_t num_entries = ask(budget);
    EXPECT_EQ(budget.whyEnded(), BudgetLimit::kEntries);
    return num_entries;
  };
  EXPECT_EQ(
      count([&](Budget& budget) { return selectCuboids(map, kRoom, {}, budget).value.size(); }),
      7U);
  EXPECT_EQ(count([&](Budget& budget) {
              return findNearest(map, {1, 1, 1}, 0xFFFFFFFFU, CuboidFilter::kAll, budget, 1e9)
                  .value.size();
            }),
            7U);
}

/// Questions about boxes that would take hours or all memory.
std::vector<Question> monstrousBoxes() {
  return {{"nearest place in unknown space",
           [](const CuboidMap& map, Budget& budget) {
             (void)findNearestFit(map, {1e4, 1e4, 1e4}, {3, 3, 3}, UnknownPolicy::kObstacle,
                                  1e4 - 100, budget);
             return "";
           }},
          {"place of a box of 1000 km",
           [](const CuboidMap& map, Budget& budget) {
             (void)findNearestFit(map, {0, 0, 0}, {1e6, 1e6, 1e6}, UnknownPolicy::kFree, 1, budget);
             return "";
           }},
          {"path of a box of 1000 km",
           [](const CuboidMap& map, Budget& budget) {
             (void)checkPath(map, {{-2e6, 0, 0}, {-3e6, 0, 0}}, {1e6, 1e6, 1e6},
                             UnknownPolicy::kFree, budget);
             return "";
           }},
          {"corridor of a robot of 1000 km", [](const CuboidMap& map, Budget& budget) {
             CorridorTask task;
             task.start_map = {-3e6, 0, 0};
             task.goal_map = {-3e6 + 2, 0, 0};
             task.size_m = {1e6, 1e6, 1e6};
             (void)findCorridor(map, task, UnknownPolicy::kFree, budget);
             return "";
           }}};
}

/// Questions about long ways that would take hours or all memory.
std::vector<Question> monstrousWays() {
  return {{"path of 1e8 m",
           [](const CuboidMap& map, Budget& budget) {
             (void)checkPath(map, {{-1e8, -9, 0}, {1e8, -9, 0}}, {1, 1, 1}, UnknownPolicy::kFree,
                             budget);
             return "";
           }},
          {"corridor through unknown space",
           [](const CuboidMap& map, Budget& budget) {
             CorridorTask task = throughTheDoor();
             task.start_map = {-kFar_m, -10, -10};
             task.goal_map = {kFar_m, -10, 10};
             task.region = CellBox{{-1000000, -20, -20}, {1000000, 20, 20}};
             (void)findCorridor(map, task, UnknownPolicy::kFree, budget);
             return "";
           }},
          {"corridor whose boxes can grow for ever",
           [](const CuboidMap& map, Budget& budget) {
             CorridorTask task = throughTheDoor();
             task.goal_map = {6, 6, 6};
             task.region = kAllCells;
             const auto corridor = findCorridor(map, task, UnknownPolicy::kFree, budget);
             EXPECT_TRUE(corridor.isFound()) << "with boxes that are not maximal";
             EXPECT_FALSE(corridor.value.boxes.empty());
             return "";
           }},
          {"motion of 1e8 m",
           [](const CuboidMap& map, Budget& budget) {
             const auto task = turningTask({-1e8, -9, 0}, {1e8, -9, 0}, {2, 1, 1});
             (void)checkMotion(map, task.body, {task.start_map, task.goal_map},
                               UnknownPolicy::kFree, budget);
             return "";
           }},
          {"way of a robot that turns, of 4 km through unknown space",
           [](const CuboidMap& map, Budget& budget) {
             auto task = turningTask({-1e5, -9, 0}, {1e5, -9, 0}, {4000, 4000, 4000});
             (void)findPosePath(map, task, UnknownPolicy::kFree, budget);
             return "";
           }},
          {"ray along far bounds", [](const CuboidMap& map, Budget& budget) {
             (void)castRay(map, {-1, 50, 1}, {1, 1, 1}, 1e9, UnknownPolicy::kFree, budget);
             return "";
           }}};
}

TEST(QueriesWithABudget, endAlsoWhereNothingIsOfTheClass) {
  CuboidMap map;
  const CellBox area{{0, 0, 0}, {80, 80, 80}};
  for (const CuboidFilter filter : {CuboidFilter::kFree, CuboidFilter::kOccupied}) {
    map.replace(area, {{area, filter == CuboidFilter::kFree ? 1.0F : -1.0F}});
    CuboidSelection selection;
    selection.filter = filter;
    Budget all;
    EXPECT_TRUE(selectCuboids(map, area, selection, all).isNotFound());
    EXPECT_TRUE(findNearest(map, {0, 0, 0}, 1, filter, all).isNotFound());
    if (filter == CuboidFilter::kOccupied) continue;  // The tree passes no brick without any.
    Budget few(QueryLimits{kForever_s, 100});
    EXPECT_EQ(selectCuboids(map, area, selection, few).status, AnswerStatus::kBudgetSpent);
    few = Budget(QueryLimits{kForever_s, 100});
    EXPECT_EQ(findNearest(map, {0, 0, 0}, 1, filter, few).status, AnswerStatus::kBudgetSpent);
  }
}

TEST(QueriesWithABudget, findTheStraightWayThroughAnyOpenSpace) {
  CuboidMap map = makeMap();
  map.replace(kAllCells, {UniformBox{{{0, 0, 0}, {400, 400, 80}}, -1.0F}});
  CorridorTask task = throughTheDoor();
  task.goal_map = {396, 395, 75};
  QueryLimits limits;
  limits.max_bricks = 2000;  // A search would divide 25,000.
  Budget budget(limits);
  EXPECT_TRUE(findCorridor(map, task, UnknownPolicy::kObstacle, budget).isFound());
}

TEST(QueriesWithABudget, endAtTheLimitOfBricksWhateverIsAsked) {
  const CuboidMap map = makeMap();
  for (const auto& questions : {monstrousBoxes(), monstrousWays()}) {
    for (const Question& question : questions) {
      Budget budget(QueryLimits{kForever_s, 100000});
      (void)question.ask(map, budget);
      EXPECT_EQ(budget.whyEnded(), BudgetLimit::kBricks) << question.name;
    }
  }
}

}  // namespace
}  // namespace cuboid_mapping
