// SPDX-License-Identifier: BSD-3-Clause
// Answers about rays and corridors.
#include "cuboid_mapping/ros/planning/planner_services.h"

#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/query/corridor_query.h"
#include "cuboid_mapping/query/path_query.h"
#include "cuboid_mapping/query/pose_path.h"
#include "cuboid_mapping/query/ray_query.h"
#include "cuboid_mapping/ros/mapping/service_call.h"

#include <tf2_eigen/tf2_eigen.h>

#include <cmath>
#include <limits>

namespace cuboid_mapping_ros {
namespace {

constexpr Entries kRays{"rays", 49};
constexpr std::size_t kCorridorBytes = 200;
constexpr std::size_t kPoseBytes = 100;

/// Default limit of a search for a corridor.
constexpr double kTimeLimit_s = 1.0;

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

/// Casts the thick ray, and the line in its middle. `point_map` is not set.
Answer<RayQueryResult> cast(const CuboidMap& map, const Ray& ray, const RayTask& task,
                            Budget& budget) {
  RayQueryResult result;
  result.distance_m = task.max_range_m;
  if (task.thickness_m > 0.0) {
    const std::vector<Eigen::Vector3d> path{ray.origin_map, ray.at(task.max_range_m)};
    const auto swept =
        checkPath(map, path, Eigen::Vector3d::Constant(task.thickness_m), task.policy, budget);
    if (swept.isFound()) {
      const Occupancy met = map.voxels().at(swept->voxel);
      result.distance_m = swept->distance_m;
      result.end = met == Occupancy::kOccupied ? RayEnd::kOccupied : RayEnd::kUnknown;
    }
  }
  // The line has no length if the thick ray is blocked at the start.
  Answer<RayQueryResult> line;
  if (result.distance_m > 0.0) {
    line = castRay(map, ray.origin_map, ray.direction_map, result.distance_m, task.policy, budget);
  }
  if (budget.isSpent()) return AnswerStatus::kBudgetSpent;
  if (!line.isFound()) return result;
  const bool is_nearer = line->end != RayEnd::kMaxRange;
  result.first_unknown_m = line->first_unknown_m;
  result.unknown_length_m = line->unknown_length_m;
  if (is_nearer) result.end = line->end;
  if (is_nearer) result.distance_m = line->distance_m;
  return result;
}

std::optional<CellBox> readRegion(ServiceCall& call, const FindCorridor::Request& request) {
  if (request.use_region != 0) return call.box(request.region, 0.0, {"region"});
  const std::optional<CellBox> region = call.map().regionOfSearch();
  if (region) call.requireLoaded(*region);
  return region;
}

CorridorTask readTask(ServiceCall& call, const FindCorridor::Request& request) {
  CorridorTask task;
  task.start_map = call.point(request.start, {"start"});
  task.goal_map = call.point(request.goal, {"goal"});
  task.size_m = call.size(request.size, request.inflation);
  task.clearance_m = ServiceCall::notNegative(request.clearance, "clearance");
  for (const Eigen::Vector3d& point : {task.start_map, task.goal_map}) {
    call.requireCells(boxAround(point, task.size_m));
  }
  task.region = readRegion(call, request);
  return task;
}

/// Class of the voxel that blocks the robot; nothing: the robot leaves the region.
using Blocker = std::optional<Occupancy>;

std::string explainBlocked(const std::string& end, const Blocker& blocker, const char* advice) {
  const std::string subject = "the robot's box at the " + end + ' ';
  if (!blocker) return subject + "leaves the region: make the region larger";
  if (*blocker == Occupancy::kOccupied) return subject + "touches an obstacle: " + advice;
  return subject + "touches unknown space: " + advice + ", or treat unknown space as free";
}

Blocker findBlocker(const CuboidMap& map, const CorridorTask& task, UnknownPolicy /*policy*/,
                    const Eigen::Vector3d& center_map) {
  const auto cells = map.grid().toCellBox(boxAround(center_map, task.size_m));
  if (!cells || (task.region && !task.region->contains(*cells))) return std::nullopt;
  return isAnyOccupied(map, *cells) ? Occupancy::kOccupied : Occupancy::kUnknown;
}

Blocker findBlocker(const CuboidMap& map, const PosePathTask& task, UnknownPolicy policy,
                    const Eigen::Isometry3d& pose) {
  const auto contact = checkPoses(map, task.body, {pose}, policy, Budget::unlimited()).front();
  if (!contact.isFound()) return std::nullopt;
  return map.voxels().at(contact->voxel);
}

template <typename WayT>
std::uint8_t resultOf(const Answer<WayT>& way) {
  using Code = FindCorridor::Response;
  switch (way.status) {
    case AnswerStatus::kFound: return Code::FOUND;
    case AnswerStatus::kInvalid: return Code::NOT_SEARCHED;
    case AnswerStatus::kBudgetSpent: return Code::TIME_LIMIT;
    default: break;
  }
  switch (way.value.blocked) {
    case Blocked::kStart: return Code::START_BLOCKED;
    case Blocked::kGoal: return Code::GOAL_BLOCKED;
    default: return Code::NO_WAY;
  }
}

/// @param task  With start_map and goal_map. @param advice  What to do about a place that is blocked.
template <typename WayT, typename TaskT>
std::string explainWay(const CuboidMap& map, const TaskT& task, UnknownPolicy policy,
                       const Answer<WayT>& way, const char* advice) {
  if (!way.isNotFound()) return way.fault;  // It was found, or see noteEnd().
  switch (way.value.blocked) {
    case Blocked::kStart:
      return explainBlocked("start", findBlocker(map, task, policy, task.start_map), advice);
    case Blocked::kGoal:
      return explainBlocked("goal", findBlocker(map, task, policy, task.goal_map), advice);
    default:
      return "there is no way: everything that the robot can reach from the start was searched";
  }
}

/// Advice after a limit has ended a search.
constexpr char kGiveMore[] = "there may be a way: give more time_limit, or a smaller region";

void addPose(const Eigen::Isometry3d& pose_map, nav_msgs::Path& path) {
  path.poses.emplace_back();
  path.poses.back().header = path.header;
  path.poses.back().pose = tf2::toMsg(pose_map);
}

/// The points of a path, each with x towards the next one in the plane; the last as the one before.
std::vector<Eigen::Isometry3d> posesAlong(const std::vector<Eigen::Vector3d>& path) {
  std::vector<Eigen::Isometry3d> poses;
  double heading_rad = 0.0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (i + 1 < path.size()) {
      const Eigen::Vector3d step = path[i + 1] - path[i];
      if (!step.head<2>().isZero()) heading_rad = std::atan2(step.y(), step.x());
    }
    poses.emplace_back(Eigen::Translation3d(path[i]) *
                       Eigen::AngleAxisd(heading_rad, Eigen::Vector3d::UnitZ()));
  }
  return poses;
}

PosePathTask readTurningTask(ServiceCall& call, const FindCorridor::Request& request) {
  if (request.headings.size() != 2) {
    throw Refusal("headings has " + std::to_string(request.headings.size()) +
                  " numbers: give two, for start and goal, or none");
  }
  PosePathTask task;
  task.body = readTurningBox(call, request.size, request.inflation);
  task.start_map = readHeaded(call, request.start, {"start"}, request.headings[0]);
  task.goal_map = readHeaded(call, request.goal, {"goal"}, request.headings[1]);
  task.may_climb = request.climb != 0;
  const Eigen::Vector3d around_m = Eigen::Vector3d::Constant(2.0 * reachOf(task.body));
  for (const Eigen::Isometry3d& pose : {task.start_map, task.goal_map}) {
    call.requireCells(boxAround(pose.translation(), around_m));
  }
  task.region = readRegion(call, request);
  const std::string fault = findFault(task, call.map().grid());
  if (!fault.empty()) throw Refusal(fault);
  return task;
}

void answerTurning(ServiceCall& call, const FindCorridor::Request& request, double limit_s,
                   FindCorridor::Response& response) {
  const UnknownPolicy policy = ServiceCall::policy(request.unknown);
  const PosePathTask task = readTurningTask(call, request);
  const auto search = [&](const CuboidMap& map, Budget& budget) {
    const auto path = findPosePath(map, task, policy, budget);
    call.info().revision = map.revision();
    response.result = resultOf(path);
    response.length = path.value.length_m;
    response.path.header = call.info().header;
    for (const Eigen::Isometry3d& pose : path.value.T_map_body) addPose(pose, response.path);
    call.info().message =
        explainWay(map, task, policy, path, "ask ~check_poses for another place or heading");
    call.noteEnd(budget, path.isFound() ? "the path has more poses than it needs" : kGiveMore);
  };
  call.read(kPoseBytes, search, limit_s);
}

}  // namespace

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
    if (!result.isFound()) return;
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
  const double asked_s = ServiceCall::notNegative(request.time_limit, "time_limit");
  const double limit_s = asked_s == 0.0 ? kTimeLimit_s : asked_s;
  if (!request.headings.empty()) return answerTurning(call, request, limit_s, response);
  const UnknownPolicy policy = ServiceCall::policy(request.unknown);
  const CorridorTask task = readTask(call, request);
  const auto search = [&](const CuboidMap& map, Budget& budget) {
    const auto answer = findCorridor(map, task, policy, budget);
    const Corridor& corridor = answer.value;
    call.info().revision = map.revision();
    response.result = resultOf(answer);
    response.length = corridor.length_m;
    for (const CellBox& box : corridor.boxes) response.boxes.push_back(boxMessage(map.grid(), box));
    for (const auto& portal : corridor.portals_map) response.portals.push_back(toPoint(portal));
    response.path.header = call.info().header;
    for (const Eigen::Isometry3d& pose : posesAlong(corridor.path_map)) {
      addPose(pose, response.path);
    }
    call.info().message =
        explainWay(map, task, policy, answer, "ask ~nearest_free for a free place");
    call.noteEnd(budget,
                 answer.isFound() ? "the boxes are not as large as they can be" : kGiveMore);
  };
  call.read(kCorridorBytes, search, limit_s);
}

}  // namespace cuboid_mapping_ros
