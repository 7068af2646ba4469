// SPDX-License-Identifier: BSD-3-Clause
// Answers whether a box or a body on a path, or a body at poses, meets obstacles.
#include "cuboid_mapping/query/motion_query.h"
#include "cuboid_mapping/query/path_query.h"
#include "cuboid_mapping/query/pose_query.h"
#include "cuboid_mapping/ros/planning/planner_services.h"
#include "cuboid_mapping/ros/queries/service_call.h"

#include <tf2_eigen/tf2_eigen.h>

#include <numeric>

namespace cuboid_mapping_ros {
namespace {

static_assert(CheckPath::Response::OCCUPIED == static_cast<int>(Occupancy::kOccupied));
static_assert(CheckPath::Response::FREE == static_cast<int>(Occupancy::kFree));

using Path = std::vector<Eigen::Vector3d>;
using PosesOfPath = std::vector<Eigen::Isometry3d>;

constexpr Entries kWaypoints{"waypoints", 46};
constexpr Entries kPaths{"paths", 78};

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
    MetricBox box = boxAround(path[i], size_m);
    const MetricBox before = boxAround(path[i == 0 ? i : i - 1], size_m);
    box.min_m = box.min_m.cwiseMin(before.min_m);
    box.max_m = box.max_m.cwiseMax(before.max_m);
    call.requireCells(box);
  }
}

/// Paths, and the edges of a box around each waypoint that encloses the robot.
struct PathTask {
  std::vector<Path> paths;
  Eigen::Vector3d around_m;
};

/// @param check  (const CuboidMap&, std::size_t path, Budget&) -> Answer<PathContact>.
template <typename CheckT>
void answerPaths(ServiceCall& call, const PathTask& task, CheckPath::Response& response,
                 const CheckT& check) {
  const std::vector<Path>& paths = task.paths;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    requireWay(call, paths[i], task.around_m);
    response.point[i] = toPoint(paths[i].front());
  }
  call.readEach(kPaths, paths.size(), [&](const CuboidMap& map, std::size_t i, Budget& budget) {
    const Answer<PathContact> contact = check(map, i, budget);
    if (budget.isSpent()) return;
    const bool is_met = contact.isFound();
    const double length_m = lengthOf(paths[i]);
    const Occupancy occupancy = is_met ? map.voxels().at(contact->voxel) : Occupancy::kFree;
    response.free[i] = static_cast<std::uint8_t>(contact.isNotFound());
    response.segment[i] = is_met ? static_cast<std::int32_t>(contact->segment) : -1;
    response.point[i] = toPoint(is_met ? contact->point_map : paths[i].back());
    response.occupancy[i] = static_cast<std::uint8_t>(occupancy);
    response.free_length[i] = is_met ? contact->distance_m : length_m;
    response.length[i] = length_m;
  });
}

/// The poses of a path, of which the first waypoint has this number in the request.
PosesOfPath readPoses(const ServiceCall& call, const CheckPath::Request& request, std::size_t first,
                      std::size_t num_poses) {
  PosesOfPath poses;
  for (std::size_t i = first; i < first + num_poses; ++i) {
    poses.push_back(readHeaded(call, request.waypoints[i], {"waypoints", i}, request.headings[i]));
  }
  return poses;
}

/// The poses of each path.
std::vector<PosesOfPath> readAllPoses(const ServiceCall& call, const CheckPath::Request& request,
                                      const std::vector<Path>& paths, const Body& body) {
  if (request.headings.size() != request.waypoints.size()) {
    throw Refusal("there are " + std::to_string(request.headings.size()) + " headings and " +
                  std::to_string(request.waypoints.size()) +
                  " waypoints: give one for each, or no headings");
  }
  std::vector<PosesOfPath> all;
  std::size_t first = 0;
  for (const Path& path : paths) {
    all.push_back(readPoses(call, request, first, path.size()));
    first += path.size();
    const std::string fault = findFault(body, all.back(), call.map().grid(), "waypoints");
    if (!fault.empty()) throw Refusal("path " + std::to_string(all.size() - 1) + ": " + fault);
  }
  return all;
}

Answer<PathContact> toPathContact(const Answer<MotionContact>& motion) {
  if (!motion.isFound()) return motion.status;
  return PathContact{motion->segment, motion->distance_m, motion->T_map_body.translation(),
                     motion->contact.voxel};
}

void answerTurning(ServiceCall& call, const CheckPath::Request& request,
                   const std::vector<Path>& paths, CheckPath::Response& response) {
  const auto policy = ServiceCall::policy(request.unknown);
  const Body body = readTurningBox(call, request.size, request.inflation);
  const std::vector<PosesOfPath> poses = readAllPoses(call, request, paths, body);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    response.orientation[i] = tf2::toMsg(poses[i].front()).orientation;
  }
  const auto check = [&](const CuboidMap& map, std::size_t i, Budget& budget) {
    const auto motion = checkMotion(map, body, poses[i], policy, budget);
    const auto& last_map = motion.isFound() ? motion->T_map_body : poses[i].back();
    if (!budget.isSpent()) response.orientation[i] = tf2::toMsg(last_map).orientation;
    return toPathContact(motion);
  };
  answerPaths(call, {paths, Eigen::Vector3d::Constant(2.0 * reachOf(body))}, response, check);
}

static_assert(CheckPoses::Response::OCCUPIED == static_cast<int>(Occupancy::kOccupied));
static_assert(CheckPoses::Response::FREE == static_cast<int>(Occupancy::kFree));

constexpr Entries kPoses{"poses", 30};
constexpr Entries kSpheres{"spheres", 32};
constexpr Entries kBodyBoxes{"boxes", 80};

void requireAsMany(const char* parts, std::size_t num_parts, const char* sizes,
                   std::size_t num_sizes) {
  if (num_parts == num_sizes) return;
  throw Refusal("there are " + std::to_string(num_parts) + ' ' + parts + " and " +
                std::to_string(num_sizes) + ' ' + sizes + ": give one for each");
}

void requireGood(const Body& body, const ServiceCall& call) {
  const std::string fault = findFault(body, call.map().grid());
  if (!fault.empty()) throw Refusal(fault);
}

Body readBody(const ServiceCall& call, const CheckPoses::Request& request) {
  call.requireFew(request.spheres.size(), kSpheres);
  call.requireFew(request.boxes.size(), kBodyBoxes);
  requireAsMany("spheres", request.spheres.size(), "radii", request.radii.size());
  requireAsMany("boxes", request.boxes.size(), "sizes", request.sizes.size());
  const double inflation_m = ServiceCall::notNegative(request.inflation, "inflation");
  Body body;
  for (std::size_t i = 0; i < request.spheres.size(); ++i) {
    body.spheres.push_back({toVector(request.spheres[i]), request.radii[i]});
  }
  for (std::size_t i = 0; i < request.boxes.size(); ++i) {
    const geometry_msgs::Vector3& size = request.sizes[i];
    body.boxes.push_back(
        {ServiceCall::localPose(request.boxes[i], {"boxes", i}), {size.x, size.y, size.z}});
  }
  requireGood(body, call);  // Inflation hides an invalid size.
  for (auto& sphere : body.spheres) sphere.radius_m += inflation_m;
  for (auto& box : body.boxes) box.size_m.array() += 2.0 * inflation_m;
  requireGood(body, call);
  return body;
}

}  // namespace

void fillBlank(const MapInFrame& /*anchor*/, const CheckPath::Request& request,
               CheckPath::Response& response) {
  const std::size_t num_paths = request.lengths.empty() ? 1 : request.lengths.size();
  response.free.assign(num_paths, static_cast<std::uint8_t>(false));
  response.segment.assign(num_paths, 0);
  response.point.resize(num_paths);
  response.occupancy.assign(num_paths, CheckPath::Response::UNKNOWN);
  response.free_length.assign(num_paths, 0.0);
  response.length.assign(num_paths, 0.0);
  if (!request.headings.empty()) response.orientation.resize(num_paths);
}

void fillBlank(const MapInFrame& /*anchor*/, const CheckPoses::Request& request,
               CheckPoses::Response& response) {
  const std::size_t num_poses = request.poses.size();
  response.free.assign(num_poses, static_cast<std::uint8_t>(false));
  response.part.assign(num_poses, -1);
  response.point.resize(num_poses);
  response.occupancy.assign(num_poses, CheckPoses::Response::UNKNOWN);
}

void answer(ServiceCall& call, const CheckPath::Request& request, CheckPath::Response& response) {
  const std::vector<Path> paths = splitPaths(call, request);
  if (!request.headings.empty()) return answerTurning(call, request, paths, response);
  const auto policy = ServiceCall::policy(request.unknown);
  const Eigen::Vector3d size_m = call.size(request.size, request.inflation);
  const auto check = [&](const CuboidMap& map, std::size_t i, Budget& budget) {
    return checkPath(map, paths[i], size_m, policy, budget);
  };
  answerPaths(call, {paths, size_m}, response, check);
}

void answer(ServiceCall& call, const CheckPoses::Request& request, CheckPoses::Response& response) {
  const auto policy = ServiceCall::policy(request.unknown);
  const Body body = readBody(call, request);
  const Eigen::Vector3d around_m = Eigen::Vector3d::Constant(2.0 * reachOf(body));
  call.requireFew(request.poses.size(), kPoses);
  std::vector<Eigen::Isometry3d> poses;
  for (const geometry_msgs::Pose& pose : request.poses) {
    poses.push_back(call.pose(pose, {"poses", poses.size()}));
    const Eigen::Vector3d center_map = poses.back().translation();
    call.requireCells(boxAround(center_map, around_m));
    response.point[poses.size() - 1] = toPoint(center_map);
  }
  call.readEach(kPoses, poses.size(), [&](const CuboidMap& map, std::size_t i, Budget& budget) {
    const auto contact = checkPoses(map, body, {poses[i]}, policy, budget).front();
    if (budget.isSpent()) return;
    response.free[i] = static_cast<std::uint8_t>(contact.isNotFound());
    response.occupancy[i] = CheckPoses::Response::FREE;
    if (!contact.isFound()) return;
    const Cell& voxel = contact->voxel;
    response.part[i] = static_cast<std::int32_t>(contact->part);
    response.point[i] = toPoint(map.grid().centerOf(CellBox::ofCell(voxel)));
    response.occupancy[i] = static_cast<std::uint8_t>(map.voxels().at(voxel));
  });
}

}  // namespace cuboid_mapping_ros
