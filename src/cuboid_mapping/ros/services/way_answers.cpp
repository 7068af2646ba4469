// SPDX-License-Identifier: BSD-3-Clause
// Answers about paths, rays and corridors.
#include "cuboid_mapping/ros/services/answers.h"

#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/query/corridor_query.h"
#include "cuboid_mapping/query/path_query.h"
#include "cuboid_mapping/query/ray_query.h"

#include <limits>
#include <numeric>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::boxAround;
using cuboid_mapping::Budget;
using cuboid_mapping::CastRays;
using cuboid_mapping::CellBox;
using cuboid_mapping::CheckPath;
using cuboid_mapping::Corridor;
using cuboid_mapping::CorridorEnd;
using cuboid_mapping::CorridorTask;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::FindCorridor;
using cuboid_mapping::Occupancy;
using cuboid_mapping::RayEnd;
using cuboid_mapping::UnknownPolicy;

static_assert(CheckPath::Response::OCCUPIED == static_cast<int>(Occupancy::kOccupied));
static_assert(CheckPath::Response::FREE == static_cast<int>(Occupancy::kFree));

constexpr int toInt(CorridorEnd end) { return static_cast<int>(end); }
static_assert(FindCorridor::Response::NOT_SEARCHED == toInt(CorridorEnd::kInvalid));
static_assert(FindCorridor::Response::FOUND == toInt(CorridorEnd::kFound));
static_assert(FindCorridor::Response::START_BLOCKED == toInt(CorridorEnd::kStartBlocked));
static_assert(FindCorridor::Response::GOAL_BLOCKED == toInt(CorridorEnd::kGoalBlocked));
static_assert(FindCorridor::Response::NO_WAY == toInt(CorridorEnd::kNoWay));
static_assert(FindCorridor::Response::TIME_LIMIT == toInt(CorridorEnd::kBudgetSpent));

using Path = std::vector<Eigen::Vector3d>;

constexpr Entries kWaypoints{"waypoints", 46};
constexpr Entries kPaths{"paths", 46};
constexpr Entries kRays{"rays", 49};
constexpr std::size_t kCorridorBytes = 200;

/// Default limit of a search for a corridor.
constexpr double kTimeLimit_s = 1.0;

/// The paths of a request.
std::vector<Path> splitPaths(const ServiceCall& call, const CheckPath::Request& request) {
  const Path all = call.points(request.waypoints, kWaypoints);
  if (all.empty()) throw Refusal("there are no waypoints: give at least one");
  call.requireFew(request.lengths.size(), kPaths);
  std::vector<std::uint32_t> lengths = request.lengths;
  if (lengths.empty()) lengths.push_back(static_cast<std::uint32_t>(all.size()));
  const auto total = std::accumulate(lengths.begin(), lengths.end(), std::uint64_t{0});
  if (total != all.size()) {
    throw Refusal("lengths add up to " + std::to_string(total) + ", but there are " +
                  std::to_string(all.size()) + " waypoints");
  }
  std::vector<Path> paths;
  auto first = all.begin();
  for (const std::uint32_t length : lengths) {
    if (length == 0) throw Refusal("lengths: every path must have at least one waypoint");
    paths.emplace_back(first, first + length);
    first += length;
  }
  return paths;
}

/// Requires the cells between all waypoints of a path.
void requireWay(ServiceCall& call, const Path& path, const Eigen::Vector3d& size_m) {
  for (std::size_t i = 0; i < path.size(); ++i) {
    cuboid_mapping::MetricBox box = boxAround(path[i], size_m);
    const cuboid_mapping::MetricBox before = boxAround(path[i == 0 ? i : i - 1], size_m);
    box.min_m = box.min_m.cwiseMin(before.min_m);
    box.max_m = box.max_m.cwiseMax(before.max_m);
    call.requireCells(box);
  }
}

struct Ray {
  Eigen::Vector3d origin_map;
  Eigen::Vector3d direction_map;  ///< Length 1.

  [[nodiscard]] Eigen::Vector3d at(double range_m) const {
    return origin_map + range_m * direction_map;
  }
};

std::vector<Ray> readRays(const ServiceCall& call, const CastRays::Request& request) {
  call.requireFew(request.origins.size(), kRays);
  if (request.origins.size() != request.directions.size()) {
    throw Refusal("origins has " + std::to_string(request.origins.size()) + " points, directions " +
                  std::to_string(request.directions.size()) + ": give one of each for every ray");
  }
  std::vector<Ray> rays;
  for (std::size_t i = 0; i < request.origins.size(); ++i) {
    rays.push_back({call.point(request.origins[i], {"origins", i}),
                    call.direction(request.directions[i], {"directions", i})});
  }
  return rays;
}

std::uint8_t codeOf(RayEnd end) {
  switch (end) {
    case RayEnd::kOccupied: return CastRays::Request::END_OCCUPIED;
    case RayEnd::kUnknown: return CastRays::Request::END_UNKNOWN;
    default: return CastRays::Request::END_MAX_RANGE;
  }
}

struct RayTask {
  double max_range_m;
  double thickness_m;
  UnknownPolicy policy;
};

/// Casts the thick ray, and the line in its middle; nothing if the budget is spent. `point_map` is not set.
std::optional<cuboid_mapping::RayQueryResult> cast(const CuboidMap& map, const Ray& ray,
                                                   const RayTask& task, Budget& budget) {
  cuboid_mapping::RayQueryResult result;
  result.distance_m = task.max_range_m;
  if (task.thickness_m > 0.0) {
    const Path path{ray.origin_map, ray.at(task.max_range_m)};
    const auto swept =
        checkPath(map, path, Eigen::Vector3d::Constant(task.thickness_m), task.policy, budget);
    if (swept.contact) {
      const Occupancy met = map.voxels().at(swept.contact->voxel);
      result.distance_m = swept.contact->distance_m;
      result.end = met == Occupancy::kOccupied ? RayEnd::kOccupied : RayEnd::kUnknown;
    }
  }
  // The line has no length if the thick ray is blocked at the start.
  const auto line = result.distance_m > 0.0 ? castRay(map, ray.origin_map, ray.direction_map,
                                                      result.distance_m, task.policy, budget)
                                            : std::nullopt;
  if (budget.isSpent()) return std::nullopt;
  if (!line) return result;
  const bool is_nearer = line->end != RayEnd::kMaxRange;
  result.first_unknown_m = line->first_unknown_m;
  result.unknown_length_m = line->unknown_length_m;
  if (is_nearer) result.end = line->end;
  if (is_nearer) result.distance_m = line->distance_m;
  return result;
}

CorridorTask readTask(ServiceCall& call, const FindCorridor::Request& request) {
  CorridorTask task;
  task.start_map = call.point(request.start, {"start"});
  task.goal_map = call.point(request.goal, {"goal"});
  task.size_m = call.size(request.size, request.inflation);
  task.policy = ServiceCall::policy(request.unknown);
  if (request.use_region != 0) task.region = call.box(request.region, 0.0, {"region"});
  for (const Eigen::Vector3d& point : {task.start_map, task.goal_map}) {
    call.requireCells(boxAround(point, task.size_m));
  }
  if (request.use_region == 0) task.region = call.map().regionOfSearch();
  if (task.region) call.requireLoaded(*task.region);
  return task;
}

/// Advice about the obstacle that blocks the robot's box.
std::string explainBlocked(const CuboidMap& map, const CorridorTask& task, const std::string& end,
                           const Eigen::Vector3d& center_map) {
  const std::string subject = "the robot's box at the " + end + ' ';
  const auto cells = map.grid().toCellBox(boxAround(center_map, task.size_m));
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

std::string explainEnd(const CuboidMap& map, const CorridorTask& task, CorridorEnd end) {
  switch (end) {
    case CorridorEnd::kStartBlocked: return explainBlocked(map, task, "start", task.start_map);
    case CorridorEnd::kGoalBlocked: return explainBlocked(map, task, "goal", task.goal_map);
    case CorridorEnd::kNoWay:
      return "there is no way: everything that the robot can reach from the start was searched";
    case CorridorEnd::kInvalid: return "the request is invalid";
    default: return {};  // It was found, or see noteEnd().
  }
}

}  // namespace

void answer(ServiceCall& call, const CheckPath::Request& request, CheckPath::Response& response) {
  const UnknownPolicy policy = ServiceCall::policy(request.unknown);
  const Eigen::Vector3d size_m = call.size(request.size, request.inflation);
  const std::vector<Path> paths = splitPaths(call, request);
  for (const Path& path : paths) {
    requireWay(call, path, size_m);
    response.point.push_back(toPoint(path.front()));
  }
  response.free.assign(paths.size(), static_cast<std::uint8_t>(false));
  response.segment.assign(paths.size(), 0);
  response.occupancy.assign(paths.size(), CheckPath::Response::UNKNOWN);
  response.free_length.assign(paths.size(), 0.0);
  response.length.assign(paths.size(), 0.0);
  call.readEach(kPaths, paths.size(), [&](const CuboidMap& map, std::size_t i, Budget& budget) {
    const auto result = checkPath(map, paths[i], size_m, policy, budget);
    if (budget.isSpent()) return;
    const auto& contact = result.contact;
    const Occupancy occupancy = contact ? map.voxels().at(contact->voxel) : Occupancy::kFree;
    response.free[i] = static_cast<std::uint8_t>(result.isFree());
    response.segment[i] = contact ? static_cast<std::int32_t>(contact->segment) : -1;
    response.point[i] = toPoint(contact ? contact->point_map : paths[i].back());
    response.occupancy[i] = static_cast<std::uint8_t>(occupancy);
    response.free_length[i] = contact ? contact->distance_m : result.length_m;
    response.length[i] = result.length_m;
  });
}

void answer(ServiceCall& call, const CastRays::Request& request, CastRays::Response& response) {
  const RayTask task{ServiceCall::positive(request.max_range, "max_range"),
                     2.0 * ServiceCall::notNegative(request.inflation, "inflation"),
                     ServiceCall::policy(request.unknown)};
  const std::vector<Ray> rays = readRays(call, request);
  const Eigen::Vector3d half_m =
      Eigen::Vector3d::Constant(0.5 * task.thickness_m + call.resolution());
  for (const Ray& ray : rays) {
    const Eigen::Vector3d end = ray.at(task.max_range_m);
    call.requireCells(
        {ray.origin_map.cwiseMin(end) - half_m, ray.origin_map.cwiseMax(end) + half_m});
    response.point.push_back(toPoint(ray.origin_map));
  }
  response.end.assign(rays.size(), CastRays::Request::END_UNKNOWN);
  response.distance.assign(rays.size(), 0.0);
  response.first_unknown.assign(rays.size(), 0.0);
  response.unknown_length.assign(rays.size(), 0.0);
  call.readEach(kRays, rays.size(), [&](const CuboidMap& map, std::size_t i, Budget& budget) {
    const auto result = cast(map, rays[i], task, budget);
    if (!result) return;
    constexpr double kNever = std::numeric_limits<double>::infinity();
    response.end[i] = codeOf(result->end);
    response.distance[i] = result->distance_m;
    response.point[i] = toPoint(rays[i].at(result->distance_m));
    response.first_unknown[i] = result->first_unknown_m.value_or(kNever);
    response.unknown_length[i] = result->unknown_length_m;
  });
}

void answer(ServiceCall& call, const FindCorridor::Request& request,
            FindCorridor::Response& response) {
  const CorridorTask task = readTask(call, request);
  const double limit_s = ServiceCall::notNegative(request.time_limit, "time_limit");
  const auto search = [&](const CuboidMap& map, Budget& budget) {
    const Corridor corridor = findCorridor(map, task, budget);
    response.result = static_cast<std::uint8_t>(corridor.end);
    response.length = corridor.length_m;
    for (const CellBox& box : corridor.boxes) response.boxes.push_back(boxMessage(map.grid(), box));
    for (const auto& portal : corridor.portals_map) response.portals.push_back(toPoint(portal));
    response.path.header = call.info().header;
    for (const Eigen::Vector3d& point : corridor.path_map) {
      response.path.poses.emplace_back();
      response.path.poses.back().header = call.info().header;
      response.path.poses.back().pose.position = toPoint(point);
      response.path.poses.back().pose.orientation.w = 1.0;
    }
    call.info().message = explainEnd(map, task, corridor.end);
    call.noteEnd(budget, corridor.end == CorridorEnd::kFound
                             ? "the boxes are not as large as they can be"
                             : "there may be a way: give more time_limit, or a smaller region");
  };
  call.read(kCorridorBytes, search, limit_s == 0.0 ? kTimeLimit_s : limit_s);
}

}  // namespace cuboid_mapping_ros
