// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/search_answers.h"

#include "cuboid_mapping/query/corridor_query.h"
#include "cuboid_mapping/query/cuboid_query.h"
#include "cuboid_mapping/query/fit_query.h"
#include "cuboid_mapping/query/nearest_query.h"
#include "cuboid_mapping/query/path_query.h"
#include "cuboid_mapping/query/value_query.h"
#include "cuboid_mapping/ros/request_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cuboid_mapping_ros {
namespace {

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
static_assert(FindCorridor::Response::TIME_LIMIT == toInt(CorridorEnd::kTimeLimit));

/// Of a search for a corridor, when the request does not say.
constexpr double kTimeLimit_s = 1.0;

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
void addCuboid(const CuboidMap& map, const Cuboid& cuboid, ResponseT& response) {
  addBox(map.grid(), cuboid.box, response);
  response.probability.push_back(
      static_cast<float>(meanProbability(map, cuboid.box).value_or(0.0)));
  response.occupancy.push_back(static_cast<std::uint8_t>(cuboid.occupancy));
}

CorridorTask readTask(RequestReader& reader, const FindCorridor::Request& request) {
  CorridorTask task;
  task.start_map = reader.point(request.start, "start");
  task.goal_map = reader.point(request.goal, "goal");
  task.size_m = reader.size(request.size, request.inflation);
  task.policy = reader.policy(request.unknown);
  task.time_limit_s = reader.notNegative(request.time_limit, "time_limit");
  if (task.time_limit_s == 0.0) task.time_limit_s = kTimeLimit_s;
  if (request.use_region != 0) task.region = reader.box(request.min, request.max, 0.0);
  for (const Eigen::Vector3d& point : {task.start_map, task.goal_map}) {
    (void)reader.cells(cuboid_mapping::boxAround(point, task.size_m));
  }
  return task;
}

std::string explain(const Corridor& corridor) {
  switch (corridor.end) {
    case CorridorEnd::kFound: return {};
    case CorridorEnd::kStartBlocked:
      return "the robot at the start meets an obstacle, unknown space that blocks, or the border "
             "of "
             "the region: ask ~nearest_free for a place, or let unknown space pass";
    case CorridorEnd::kGoalBlocked:
      return "the robot at the goal meets an obstacle, unknown space that blocks, or the border of "
             "the region: ask ~nearest_free for a place, or let unknown space pass";
    case CorridorEnd::kNoWay:
      return "there is no way: all that the robot can reach from the start was searched";
    case CorridorEnd::kTimeLimit: return "not found within time_limit: give more time or a region";
    default: return "the request cannot be searched for";
  }
}

FindCorridor::Response toMessage(const Grid& grid, const Corridor& corridor) {
  FindCorridor::Response response;
  response.message = explain(corridor);
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
  const auto points = reader.points(request.points, "points");
  const double inflation_m = reader.notNegative(request.inflation, "inflation");
  double max_m = reader.notNegative(request.max_distance, "max_distance");
  max_m = max_m == 0.0 ? std::numeric_limits<double>::infinity() : max_m + inflation_m;
  reader.require(request.k > 0, "k is 0: ask for at least one cuboid");
  if (!reader.isGood()) return refuse<FindNearest::Response>(reader.error());
  return map.map.read([&](const CuboidMap& content, const ros::Time& stamp) {
    FindNearest::Response response;
    fillHead(map, content, stamp, response);
    for (const Eigen::Vector3d& point : points) {
      const auto nearest = findNearest(content, point, request.k, filter, max_m);
      response.counts.push_back(static_cast<std::uint32_t>(nearest.size()));
      for (const cuboid_mapping::NearestCuboid& near : nearest) {
        response.distance.push_back(std::max(0.0, near.distance_m - inflation_m));
        response.closest.push_back(toPoint(near.closest_point_map));
        response.direction.push_back(toVector3(near.direction_map));
        addCuboid(content, near.cuboid, response);
      }
    }
    return response;
  });
}

FindNearestFree::Response answerFindNearestFree(const MapInFrame& map,
                                                const FindNearestFree::Request& request) {
  RequestReader reader(map, request.header);
  const auto points = reader.points(request.points, "points");
  const Eigen::Vector3d size_m = reader.size(request.size, request.inflation);
  const auto policy = reader.policy(request.unknown);
  const double max_m = reader.notNegative(request.max_distance, "max_distance");
  reader.require(max_m > 0.0, "max_distance is 0: say how far the place may be");
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d reach_m = size_m.array() + 2.0 * max_m;
    (void)reader.cells(cuboid_mapping::boxAround(point, reach_m));
  }
  if (!reader.isGood()) return refuse<FindNearestFree::Response>(reader.error());
  return map.map.read([&](const CuboidMap& content, const ros::Time& stamp) {
    FindNearestFree::Response response;
    fillHead(map, content, stamp, response);
    for (const Eigen::Vector3d& point : points) {
      const auto place = findNearestFit(content, point, size_m, policy, max_m);
      response.found.push_back(static_cast<std::uint8_t>(place.has_value()));
      response.place.push_back(toPoint(place.value_or(point)));
      response.distance.push_back(place ? (*place - point).norm()
                                        : std::numeric_limits<double>::infinity());
    }
    return response;
  });
}

GetCuboids::Response answerGetCuboids(const MapInFrame& map, const GetCuboids::Request& request) {
  RequestReader reader(map, request.header);
  const CellBox region =
      request.everything != 0 ? kAllCells : reader.box(request.min, request.max, request.inflation);
  cuboid_mapping::CuboidSelection selection;
  selection.filter = readClasses(reader, request.classes);
  const double min_edge = std::ceil(
      reader.notNegative(request.min_edge, "min_edge") / map.map.grid().resolution() - 1e-6);
  selection.min_edge = static_cast<std::int32_t>(std::min(min_edge, 1.0 * Grid::kMaxCell));
  selection.is_clipped = request.clip != 0;
  selection.max_cuboids = toLimit(request.limit);
  if (!reader.isGood()) return refuse<GetCuboids::Response>(reader.error());
  return map.map.read([&](const CuboidMap& content, const ros::Time& stamp) {
    GetCuboids::Response response;
    fillHead(map, content, stamp, response);
    const auto selected = selectCuboids(content, region, selection);
    response.truncated = static_cast<std::uint8_t>(selected.is_truncated);
    for (const Cuboid& cuboid : selected.cuboids) addCuboid(content, cuboid, response);
    return response;
  });
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
                   "size reaches beyond the map: give the robot's edges in metres");
    passage = size.value_or(passage);
  }
  if (!reader.isGood()) return refuse<GetFreeGraph::Response>(reader.error());
  return map.map.read([&](const CuboidMap& content, const ros::Time& stamp) {
    GetFreeGraph::Response response;
    fillHead(map, content, stamp, response);
    const auto graph = buildFreeGraph(content, region, passage, toLimit(request.limit));
    response.truncated = static_cast<std::uint8_t>(graph.is_truncated);
    for (const Cuboid& cuboid : graph.cuboids) addBox(content.grid(), cuboid.box, response);
    for (const auto& portal : graph.portals) {
      const MetricBox face = content.grid().toMetricBox(portal.face);
      response.first.push_back(portal.first);
      response.second.push_back(portal.second);
      response.portal_min.push_back(toPoint(face.min_m));
      response.portal_max.push_back(toPoint(face.max_m));
    }
    return response;
  });
}

FindCorridor::Response answerFindCorridor(const MapInFrame& map,
                                          const FindCorridor::Request& request) {
  RequestReader reader(map, request.header);
  const CorridorTask task = readTask(reader, request);
  if (!reader.isGood()) return refuse<FindCorridor::Response>(reader.error());
  return map.map.read([&](const CuboidMap& content, const ros::Time& stamp) {
    FindCorridor::Response response = toMessage(content.grid(), findCorridor(content, task));
    fillHead(map, content, stamp, response);
    response.path.header = response.header;
    for (auto& pose : response.path.poses) pose.header = response.header;
    return response;
  });
}

}  // namespace cuboid_mapping_ros
