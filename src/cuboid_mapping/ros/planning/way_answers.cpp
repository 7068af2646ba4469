// SPDX-License-Identifier: BSD-3-Clause
// Answers about rays and corridors.
#include "cuboid_mapping/ros/planning/planner_services.h"

#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/query/corridor_query.h"
#include "cuboid_mapping/query/path_query.h"
#include "cuboid_mapping/query/pose_path.h"
#include "cuboid_mapping/query/ray_query.h"
#include "cuboid_mapping/ros/queries/service_call.h"

#include <tf2_eigen/tf2_eigen.h>

#include <cmath>
#include <limits>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::counted;
using cuboid_mapping::toText;

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
    throw Refusal("origins has " + counted(request.origins.size(), "point") + ", directions has " +
                  counted(request.directions.size(), "vector") +
                  ": give one of each for every ray");
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
  if (request.region != Box()) {  // A robot would leave it, and nobody would know why.
    throw Refusal("region is given, but use_region is false: set use_region: true, or no region");
  }
  const std::optional<CellBox> region = call.map().regionOfSearch();
  if (region) call.requireLoaded(*region);
  return region;
}

/// A limit, which may be infinite.
double readLimit(double value, const char* name) {
  return value == INFINITY ? value : ServiceCall::notNegative(value, name);
}

template <typename TaskT>
void readRoom(const FindCorridor::Request& request, TaskT& task) {
  task.clearance_m = ServiceCall::notNegative(request.clearance, "clearance");
  task.start_tolerance_m = readLimit(request.start_tolerance, "start_tolerance");
  task.goal_tolerance_m = readLimit(request.goal_tolerance, "goal_tolerance");
}

CorridorTask readTask(ServiceCall& call, const FindCorridor::Request& request) {
  CorridorTask task;
  task.start_map = call.point(request.start, {"start"});
  task.goal_map = call.point(request.goal, {"goal"});
  task.size_m = call.size(request.size, request.inflation);
  readRoom(request, task);
  for (const Eigen::Vector3d& point : {task.start_map, task.goal_map}) {
    call.requireCells(boxAround(point, task.size_m));
  }
  task.region = readRegion(call, request);
  return task;
}

static_assert(FindCorridor::Response::OCCUPIED == static_cast<int>(Occupancy::kOccupied));
static_assert(FindCorridor::Response::FREE == static_cast<int>(Occupancy::kFree));

/// Says what the robot touches at an end of its way. @param met  Nothing: it leaves the region.
std::string explainMet(const CuboidMap& map, const char* end, const std::optional<Cell>& met) {
  const std::string subject = std::string("the robot's box at the ") + end;
  if (!met) return subject + " leaves the region";
  const bool is_occupied = map.voxels().at(*met) == Occupancy::kOccupied;
  return subject + " touches " + (is_occupied ? "an obstacle" : "unknown space") + " at " +
         toText(map.grid().centerOf(CellBox::ofCell(*met)));
}

std::string explainBlocked(const CuboidMap& map, const char* end, const std::optional<Cell>& met,
                           double tolerance_m) {
  const bool is_unknown = met && map.voxels().at(*met) == Occupancy::kUnknown;
  const bool is_start = end == std::string("start");
  const std::string tolerance = std::string(end) + "_tolerance";
  const std::string advice =
      tolerance_m > 0.0
          ? (is_start ? ", and no way out is within " : ", and no free place is within ") +
                tolerance + ": move the " + end
          : ": a larger " + tolerance + (is_start ? " lets it leave" : " lets the path end nearby");
  return explainMet(map, end, met) + advice + (met ? "" : ", or make the region larger") +
         (is_unknown ? ", or treat unknown space as free (unknown: 1)" : "");
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

/// Says that a way does not go from start to goal as they were asked for; else empty.
template <typename WayT>
std::string explainEnds(const CuboidMap& map, const WayT& way) {
  std::string text;
  if (way.start_distance_m > 0.0) {
    text = explainMet(map, "start", way.met) + ": the path leads out of it first, for " +
           toText(way.start_distance_m) + " m";
  }
  if (way.goal_distance_m > 0.0) {
    text += std::string(text.empty() ? "" : "; ") + "the path ends " + toText(way.goal_distance_m) +
            " m from the goal, as near as the robot gets";
  }
  return text;
}

template <typename WayT, typename TaskT>
std::string explainWay(const CuboidMap& map, const TaskT& task, UnknownPolicy policy,
                       const Answer<WayT>& way) {
  if (way.isFound()) return explainEnds(map, *way);
  if (!way.isNotFound()) return way.fault;  // See noteEnd().
  switch (way.value.blocked) {
    case Blocked::kStart:
      return explainBlocked(map, "start", way.value.met, task.start_tolerance_m);
    case Blocked::kGoal: return explainBlocked(map, "goal", way.value.met, task.goal_tolerance_m);
    default:
      return std::string(
                 "there is no way: everything that the robot can reach from the start was "
                 "searched") +
             (policy == UnknownPolicy::kFree && !task.region
                  ? ", at the heights of start and goal; use_region allows others"
                  : "");
  }
}

/// The fields that paths with and without headings have.
template <typename WayT>
void fillWay(const CuboidMap& map, const Answer<WayT>& way, FindCorridor::Response& response) {
  response.result = resultOf(way);
  response.length = way.value.length_m;
  response.start_distance = way.value.start_distance_m;
  response.goal_distance = way.value.goal_distance_m;
  response.occupancy = FindCorridor::Response::FREE;
  if (!way.value.met) return;
  response.point = toPoint(map.grid().centerOf(CellBox::ofCell(*way.value.met)));
  response.occupancy = static_cast<std::uint8_t>(map.voxels().at(*way.value.met));
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
    throw Refusal("headings has " + counted(request.headings.size(), "number") +
                  ": give two, for start and goal, or none");
  }
  PosePathTask task;
  task.body = readTurningBox(call, request.size, request.inflation);
  task.start_map = readHeaded(call, request.start, {"start"}, request.headings[0]);
  task.goal_map = readHeaded(call, request.goal, {"goal"}, request.headings[1]);
  task.may_climb = request.climb != 0;
  readRoom(request, task);
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
    fillWay(map, path, response);
    response.path.header = call.info().header;
    for (const Eigen::Isometry3d& pose : path.value.T_map_body) addPose(pose, response.path);
    call.info().message = explainWay(map, task, policy, path);
    call.noteEnd(budget, path.isFound() ? "the path has more poses than it needs" : kGiveMore);
  };
  call.read(kPoseBytes, search, limit_s);
}

}  // namespace

void fillBlank(const MapInFrame& /*anchor*/, const CastRays::Request& request,
               CastRays::Response& response) {
  const std::size_t num_rays = request.origins.size();
  response.end.assign(num_rays, CastRays::Request::END_UNKNOWN);
  response.distance.assign(num_rays, 0.0);
  response.point.resize(num_rays);
  response.first_unknown.assign(num_rays, 0.0);
  response.unknown_length.assign(num_rays, 0.0);
}

void answer(ServiceCall& call, const CastRays::Request& request, CastRays::Response& response) {
  const RayTask task{ServiceCall::positive(request.max_range, "max_range"),
                     2.0 * ServiceCall::notNegative(request.inflation, "inflation"),
                     ServiceCall::policy(request.unknown)};
  const std::vector<Ray> rays = readRays(call, request);
  const Eigen::Vector3d half_m =
      Eigen::Vector3d::Constant(0.5 * task.thickness_m + call.resolution());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Eigen::Vector3d& origin = rays[i].origin_map;
    const Eigen::Vector3d end = rays[i].at(task.max_range_m);
    call.requireCells({origin.cwiseMin(end) - half_m, origin.cwiseMax(end) + half_m});
    response.point[i] = toPoint(origin);
  }
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
  const double asked_s = readLimit(request.time_limit, "time_limit");
  const double limit_s = asked_s == 0.0 ? kTimeLimit_s : asked_s;
  if (!request.headings.empty()) return answerTurning(call, request, limit_s, response);
  const UnknownPolicy policy = ServiceCall::policy(request.unknown);
  const CorridorTask task = readTask(call, request);
  const auto search = [&](const CuboidMap& map, Budget& budget) {
    const auto answer = findCorridor(map, task, policy, budget);
    const Corridor& corridor = answer.value;
    call.info().revision = map.revision();
    fillWay(map, answer, response);
    for (const CellBox& box : corridor.boxes) response.boxes.push_back(boxMessage(map.grid(), box));
    for (const auto& portal : corridor.portals_map) response.portals.push_back(toPoint(portal));
    response.path.header = call.info().header;
    for (const Eigen::Isometry3d& pose : posesAlong(corridor.path_map)) {
      addPose(pose, response.path);
    }
    call.info().message = explainWay(map, task, policy, answer);
    call.noteEnd(budget,
                 answer.isFound() ? "the boxes are not as large as they can be" : kGiveMore);
  };
  call.read(kCorridorBytes, search, limit_s);
}

}  // namespace cuboid_mapping_ros
