// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/services/search_answers.h"

#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/query/corridor_query.h"
#include "cuboid_mapping/query/cuboid_query.h"
#include "cuboid_mapping/query/fit_query.h"
#include "cuboid_mapping/query/nearest_query.h"
#include "cuboid_mapping/query/path_query.h"
#include "cuboid_mapping/query/value_query.h"
#include "cuboid_mapping/ros/services/limited_answer.h"
#include "cuboid_mapping/ros/services/request_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::Budget;
using cuboid_mapping::CellBox;
using cuboid_mapping::Corridor;
using cuboid_mapping::CorridorEnd;
using cuboid_mapping::CorridorTask;
using cuboid_mapping::Cuboid;
using cuboid_mapping::CuboidFilter;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::FindCorridor;
using cuboid_mapping::FindNearest;
using cuboid_mapping::FindNearestFree;
using cuboid_mapping::GetCuboids;
using cuboid_mapping::GetFreeGraph;
using cuboid_mapping::Grid;
using cuboid_mapping::kAllCells;
using cuboid_mapping::MetricBox;

constexpr int toInt(CorridorEnd end) { return static_cast<int>(end); }
static_assert(FindCorridor::Response::NOT_SEARCHED == toInt(CorridorEnd::kInvalid));
static_assert(FindCorridor::Response::FOUND == toInt(CorridorEnd::kFound));
static_assert(FindCorridor::Response::START_BLOCKED == toInt(CorridorEnd::kStartBlocked));
static_assert(FindCorridor::Response::GOAL_BLOCKED == toInt(CorridorEnd::kGoalBlocked));
static_assert(FindCorridor::Response::NO_WAY == toInt(CorridorEnd::kNoWay));
static_assert(FindCorridor::Response::TIME_LIMIT == toInt(CorridorEnd::kBudgetSpent));

/// Of a search for a corridor, when the request does not say.
constexpr double kTimeLimit_s = 1.0;

// Of each entry of an answer.
constexpr std::size_t kNearestBytes = 133;
constexpr std::size_t kPlaceBytes = 33;
constexpr std::size_t kCuboidBytes = 53;
constexpr std::size_t kPortalBytes = 56;
constexpr std::size_t kCorridorBytes = 200;

std::size_t toLimit(std::uint32_t limit) {
  return limit == 0 ? std::numeric_limits<std::size_t>::max() : limit;
}

/// FREE, OCCUPIED or ALL, which have the same values in all requests.
CuboidFilter readClasses(RequestReader& reader, std::uint8_t classes) {
  reader.require(classes >= 1 && classes <= 3, "classes is " + std::to_string(classes) +
                                                   ": use FREE (1), OCCUPIED (2) or ALL (3)");
  if (classes == 3) return CuboidFilter::kAll;
  return classes == 2 ? CuboidFilter::kOccupied : CuboidFilter::kFree;
}

template <typename ResponseT>
void addBox(const Grid& grid, const CellBox& box, ResponseT& response) {
  const MetricBox box_map = grid.toMetricBox(box);
  response.min.push_back(toPoint(box_map.min_m));
  response.max.push_back(toPoint(box_map.max_m));
}

template <typename ResponseT>
void addCuboid(const CuboidMap& map, const Cuboid& cuboid, Budget& budget, ResponseT& response) {
  addBox(map.grid(), cuboid.box, response);
  response.probability.push_back(
      static_cast<float>(meanProbability(map, cuboid.box, budget).value_or(0.0)));
  response.occupancy.push_back(static_cast<std::uint8_t>(cuboid.occupancy));
}

/// Says that there is more, by the request's own limit or by the node's.
template <typename ResponseT>
void noteCut(const MapInFrame& map, const Budget& budget, bool is_cut, ResponseT& response) {
  response.truncated = static_cast<std::uint8_t>(is_cut);
  if (is_cut) response.message = "there are more cuboids than limit";
  noteEnd(map, budget, "ask for a smaller region, or region by region", response);
}

CorridorTask readTask(const MapInFrame& map, RequestReader& reader,
                      const FindCorridor::Request& request) {
  CorridorTask task;
  task.start_map = reader.point(request.start, {"start"});
  task.goal_map = reader.point(request.goal, {"goal"});
  task.size_m = reader.size(request.size, request.inflation);
  task.policy = reader.policy(request.unknown);
  if (request.use_region != 0) task.region = reader.box(request.min, request.max, 0.0);
  for (const Eigen::Vector3d& point : {task.start_map, task.goal_map}) {
    (void)reader.cells(cuboid_mapping::boxAround(point, task.size_m));
  }
  if (request.use_region == 0) task.region = map.map.regionOfSearch();
  if (task.region) reader.requireLoaded(*task.region);
  return task;
}

/// What the robot's box meets where it is blocked: what to do depends on it.
std::string explainBlocked(const CuboidMap& map, const CorridorTask& task, const std::string& end,
                           const Eigen::Vector3d& center_map) {
  const std::string subject = "the robot's box at the " + end + ' ';
  const auto cells = map.grid().toCellBox(cuboid_mapping::boxAround(center_map, task.size_m));
  if (!cells || (task.region && !task.region->contains(*cells))) {
    return subject + "leaves the region: make the region larger";
  }
  if (cuboid_mapping::isAnyOccupied(map, *cells)) {
    return subject + "touches an obstacle: ask ~nearest_free for a free place";
  }
  return subject +
         "touches unknown space: ask ~nearest_free for a free place, or treat unknown "
         "space as free";
}

std::string explain(const CuboidMap& map, const CorridorTask& task, const Corridor& corridor) {
  switch (corridor.end) {
    case CorridorEnd::kFound: return {};
    case CorridorEnd::kStartBlocked: return explainBlocked(map, task, "start", task.start_map);
    case CorridorEnd::kGoalBlocked: return explainBlocked(map, task, "goal", task.goal_map);
    case CorridorEnd::kNoWay:
      return "there is no way: everything that the robot can reach from the start was searched";
    case CorridorEnd::kBudgetSpent: return {};  // See noteEnd().
    default: return "the request is invalid";
  }
}

FindCorridor::Response toMessage(const CuboidMap& map, const CorridorTask& task,
                                 const Corridor& corridor) {
  const Grid& grid = map.grid();
  FindCorridor::Response response;
  response.message = explain(map, task, corridor);
  response.result = static_cast<std::uint8_t>(corridor.end);
  response.length = corridor.length_m;
  for (const CellBox& box : corridor.boxes) addBox(grid, box, response);
  for (const Eigen::Vector3d& portal : corridor.portals_map) {
    response.portals.push_back(toPoint(portal));
  }
  for (const Eigen::Vector3d& point : corridor.path_map) {
    response.path.poses.emplace_back();
    response.path.poses.back().pose.position = toPoint(point);
    response.path.poses.back().pose.orientation.w = 1.0;
  }
  return response;
}

}  // namespace

FindNearest::Response answerFindNearest(const MapInFrame& map,
                                        const FindNearest::Request& request) {
  RequestReader reader(map, request.header);
  const CuboidFilter filter = readClasses(reader, request.classes);
  reader.requireFew(request.points.size(), "points", kNearestBytes);
  const auto points = reader.points(request.points, "points");
  const double inflation_m = reader.notNegative(request.inflation, "inflation");
  double max_m = reader.notNegative(request.max_distance, "max_distance");
  max_m = max_m == 0.0 ? std::numeric_limits<double>::infinity() : max_m + inflation_m;
  reader.require(request.k > 0, "k is 0: ask for at least one cuboid");
  for (const Eigen::Vector3d& point : points) {
    const auto box = std::isfinite(max_m) ? map.map.grid().toCellBox(cuboid_mapping::boxAround(
                                                point, Eigen::Vector3d::Constant(2.0 * max_m)))
                                          : std::nullopt;
    reader.requireLoaded(box.value_or(kAllCells));
  }
  if (!reader.isGood()) return refuse<FindNearest::Response>(reader.error());
  FindNearest::Response response;
  readWithin(
      map, kNearestBytes, [&](const CuboidMap& content, const ros::Time& stamp, Budget& budget) {
        fillHead(map, content, stamp, response);
        answerEach(map, points.size(), "points", budget, response, [&](std::size_t i) {
          const auto nearest = findNearest(content, points[i], request.k, filter, max_m, budget);
          if (budget.isSpent()) return;
          response.counts.push_back(static_cast<std::uint32_t>(nearest.size()));
          for (const cuboid_mapping::NearestCuboid& near : nearest) {
            response.distance.push_back(std::max(0.0, near.distance_m - inflation_m));
            response.closest.push_back(toPoint(near.closest_point_map));
            response.direction.push_back(toVector3(near.direction_map));
            addCuboid(content, near.cuboid, Budget::unlimited(), response);
          }
        });
      });
  return response;
}

FindNearestFree::Response answerFindNearestFree(const MapInFrame& map,
                                                const FindNearestFree::Request& request) {
  RequestReader reader(map, request.header);
  reader.requireFew(request.points.size(), "points", kPlaceBytes);
  const auto points = reader.points(request.points, "points");
  const Eigen::Vector3d size_m = reader.size(request.size, request.inflation);
  const auto policy = reader.policy(request.unknown);
  const double max_m = reader.notNegative(request.max_distance, "max_distance");
  reader.require(max_m > 0.0, "max_distance is 0: it must be greater than 0");
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d reach_m = size_m.array() + 2.0 * max_m;
    (void)reader.cells(cuboid_mapping::boxAround(point, reach_m));
  }
  if (!reader.isGood()) return refuse<FindNearestFree::Response>(reader.error());
  FindNearestFree::Response response;
  response.found.assign(points.size(), static_cast<std::uint8_t>(false));
  response.distance.assign(points.size(), std::numeric_limits<double>::infinity());
  for (const Eigen::Vector3d& point : points) response.place.push_back(toPoint(point));
  readWithin(
      map, kPlaceBytes, [&](const CuboidMap& content, const ros::Time& stamp, Budget& budget) {
        fillHead(map, content, stamp, response);
        answerEach(map, points.size(), "points", budget, response, [&](std::size_t i) {
          const auto place = findNearestFit(content, points[i], size_m, policy, max_m, budget);
          if (!place) return;
          response.found[i] = static_cast<std::uint8_t>(true);
          response.place[i] = toPoint(*place);
          response.distance[i] = (*place - points[i]).norm();
        });
      });
  return response;
}

GetCuboids::Response answerGetCuboids(const MapInFrame& map, const GetCuboids::Request& request) {
  RequestReader reader(map, request.header);
  const CellBox region =
      request.everything != 0 ? kAllCells : reader.box(request.min, request.max, request.inflation);
  cuboid_mapping::CuboidSelection selection;
  selection.filter = readClasses(reader, request.classes);
  reader.requireLoaded(region);
  const double min_edge = std::ceil(
      reader.notNegative(request.min_edge, "min_edge") / map.map.grid().resolution() - 1e-6);
  if (!reader.isGood()) return refuse<GetCuboids::Response>(reader.error());
  selection.min_edge = static_cast<std::int32_t>(std::min(min_edge, 1.0 * Grid::kMaxCell));
  selection.is_clipped = request.clip != 0;
  selection.max_cuboids = toLimit(request.limit);
  GetCuboids::Response response;
  readWithin(map, kCuboidBytes,
             [&](const CuboidMap& content, const ros::Time& stamp, Budget& budget) {
               fillHead(map, content, stamp, response);
               const auto selected = selectCuboids(content, region, selection, budget);
               for (const Cuboid& cuboid : selected.cuboids) {
                 if (!budget.spendAndYield()) break;
                 addCuboid(content, cuboid, budget, response);
               }
               noteCut(map, budget, selected.is_truncated, response);
             });
  return response;
}

GetFreeGraph::Response answerGetFreeGraph(const MapInFrame& map,
                                          const GetFreeGraph::Request& request) {
  RequestReader reader(map, request.header);
  const CellBox region = reader.box(request.min, request.max, 0.0);
  const double inflation_m = reader.notNegative(request.inflation, "inflation");
  cuboid_mapping::Cell passage;
  if (request.size.x != 0.0 || request.size.y != 0.0 || request.size.z != 0.0) {
    const auto size = map.map.grid().toSizeInCells(reader.size(request.size, inflation_m));
    reader.require(size.has_value(),
                   "size is larger than any map: give the robot's edges in metres");
    passage = size.value_or(passage);
  }
  if (!reader.isGood()) return refuse<GetFreeGraph::Response>(reader.error());
  GetFreeGraph::Response response;
  readWithin(
      map, kPortalBytes, [&](const CuboidMap& content, const ros::Time& stamp, Budget& budget) {
        fillHead(map, content, stamp, response);
        const auto graph = buildFreeGraph(content, region, passage, toLimit(request.limit), budget);
        noteCut(map, budget, graph.is_truncated, response);
        for (const Cuboid& cuboid : graph.cuboids) addBox(content.grid(), cuboid.box, response);
        for (const auto& portal : graph.portals) {
          const MetricBox face = content.grid().toMetricBox(portal.face);
          response.first.push_back(portal.first);
          response.second.push_back(portal.second);
          response.portal_min.push_back(toPoint(face.min_m));
          response.portal_max.push_back(toPoint(face.max_m));
        }
      });
  return response;
}

FindCorridor::Response answerFindCorridor(const MapInFrame& map,
                                          const FindCorridor::Request& request) {
  RequestReader reader(map, request.header);
  const CorridorTask task = readTask(map, reader, request);
  double time_limit_s = reader.notNegative(request.time_limit, "time_limit");
  if (time_limit_s == 0.0) time_limit_s = kTimeLimit_s;
  if (!reader.isGood()) return refuse<FindCorridor::Response>(reader.error());
  FindCorridor::Response response;
  const auto search = [&](const CuboidMap& content, const ros::Time& stamp, Budget& budget) {
    FindCorridor::Response head;
    fillHead(map, content, stamp, head);
    const Corridor corridor = findCorridor(content, task, budget);
    response = toMessage(content, task, corridor);
    response.success = head.success;
    response.header = head.header;
    response.revision = head.revision;
    noteEnd(map, budget,
            corridor.end == CorridorEnd::kFound
                ? "the boxes are not as large as they can be"
                : "there may be a way: give more time_limit, or a smaller region",
            response);
  };
  readWithin(map, kCorridorBytes, search, time_limit_s);
  response.path.header = response.header;
  for (auto& pose : response.path.poses) pose.header = response.header;
  return response;
}

}  // namespace cuboid_mapping_ros
