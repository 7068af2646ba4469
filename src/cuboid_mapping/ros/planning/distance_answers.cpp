// SPDX-License-Identifier: BSD-3-Clause
// Answers about distances to obstacles, the nearest cuboids and places, and frontiers.
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/query/fit_query.h"
#include "cuboid_mapping/query/frontier_query.h"
#include "cuboid_mapping/query/nearest_query.h"
#include "cuboid_mapping/query/obstacle_distance.h"
#include "cuboid_mapping/query/path_query.h"
#include "cuboid_mapping/ros/planning/planner_services.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cuboid_mapping_ros {
namespace {

constexpr Entries kDistancePoints{"points", 32};
constexpr std::size_t kFrontierBytes = 61;

FrontierTask readTask(ServiceCall& call, const GetFrontiers::Request& request) {
  FrontierTask task;
  task.size_m = call.size(request.size, request.inflation);
  task.min_voxels = request.min_voxels;
  task.first = request.first;
  task.max_distance_m = ServiceCall::notNegative(request.max_distance, "max_distance");
  task.view_range_m = ServiceCall::notNegative(request.view_range, "view_range");
  const double max_view_m = FrontierTask::kMaxViewRange * call.resolution();
  if (task.view_range_m > max_view_m) {
    throw Refusal("view_range is " + cuboid_mapping::toText(task.view_range_m) +
                  " m: use at most " + cuboid_mapping::toText(max_view_m) + " m (500 voxels)");
  }
  if (request.everything == 0) task.region = call.box(request.region, 0.0, {"region"});
  call.requireLoaded(task.region);
  return task;
}

constexpr Entries kNearestPoints{"points", 113};
constexpr Entries kPlacePoints{"points", 33};

}  // namespace

void fillBlank(const MapInFrame& /*anchor*/, const GetDistances::Request& request,
               GetDistances::Response& response) {
  response.distance.assign(request.points.size(), 0.0);
  response.gradient.resize(request.points.size());
}

void fillBlank(const MapInFrame& /*anchor*/, const FindNearest::Request& request,
               FindNearest::Response& response) {
  response.counts.assign(request.points.size(), 0);
}

void fillBlank(const MapInFrame& /*anchor*/, const FindNearestFree::Request& request,
               FindNearestFree::Response& response) {
  const std::size_t num_points = request.points.size();
  response.found.assign(num_points, static_cast<std::uint8_t>(false));
  response.place.resize(num_points);
  response.distance.assign(num_points, std::numeric_limits<double>::infinity());
}

void answer(ServiceCall& call, const GetDistances::Request& request,
            GetDistances::Response& response) {
  const auto policy = ServiceCall::policy(request.unknown);
  const auto points = call.points(request.points, kDistancePoints);
  const double max_m = ServiceCall::positive(request.max_distance, "max_distance");
  const Eigen::Vector3d around_m = Eigen::Vector3d::Constant(2.0 * (max_m + call.resolution()));
  for (const Eigen::Vector3d& point : points) {
    call.requireCells(boxAround(point, around_m));
  }
  call.readEach(kDistancePoints, points.size(),
                [&](const CuboidMap& map, std::size_t i, Budget& budget) {
                  const auto found = findObstacleDistance(map, points[i], max_m, policy, budget);
                  if (budget.isSpent()) return;
                  response.distance[i] = found.value.distance_m;
                  response.gradient[i] = toVector3(found.value.gradient_map);
                });
}

void answer(ServiceCall& call, const GetFrontiers::Request& request,
            GetFrontiers::Response& response) {
  const FrontierTask task = readTask(call, request);
  call.read(kFrontierBytes, [&](const CuboidMap& map, Budget& budget) {
    const auto found = findFrontiers(map, task, budget);
    if (!found.fault.empty()) throw Refusal(found.fault);
    for (const Frontier& frontier : found.value) {
      if (request.with_voxels != 0 && !budget.addEntries(frontier.voxels.size())) break;
      response.center.push_back(toPoint(frontier.center_map));
      response.found.push_back(static_cast<std::uint8_t>(frontier.place_map.has_value()));
      response.place.push_back(toPoint(frontier.place_map.value_or(frontier.center_map)));
      response.unknown_volume.push_back(frontier.unknown_volume_m3);
      response.counts.push_back(static_cast<std::uint32_t>(frontier.voxels.size()));
      if (request.with_voxels == 0) continue;
      for (const Cell& cell : frontier.voxels) {
        response.voxels.push_back(toPoint(map.grid().centerOf(CellBox::ofCell(cell))));
      }
    }
    const auto num_answered = static_cast<std::uint32_t>(response.center.size());
    call.info().answered = request.first + num_answered;
    call.noteEnd(budget, num_answered == 0
                             ? "ask for a smaller region, or a shorter view_range"
                             : "ask again with first: " + std::to_string(call.info().answered));
  });
}

void answer(ServiceCall& call, const FindNearest::Request& request,
            FindNearest::Response& response) {
  const auto filter = ServiceCall::classes(request.classes);
  const auto points = call.points(request.points, kNearestPoints);
  const double inflation_m = ServiceCall::notNegative(request.inflation, "inflation");
  double max_m = ServiceCall::notNegative(request.max_distance, "max_distance");
  max_m = max_m == 0.0 ? std::numeric_limits<double>::infinity() : max_m + inflation_m;
  if (request.k == 0) throw Refusal("k is 0: ask for at least one cuboid");
  const Eigen::Vector3d reach_m = Eigen::Vector3d::Constant(2.0 * max_m);
  for (const Eigen::Vector3d& point : points) {
    const auto box = std::isfinite(max_m) ? call.map().grid().toCellBox(boxAround(point, reach_m))
                                          : std::nullopt;
    call.requireLoaded(box.value_or(kAllCells));
  }
  const auto answer_point = [&](const CuboidMap& map, std::size_t i, Budget& budget) {
    const auto nearest = findNearest(map, points[i], request.k, filter, budget, max_m).value;
    if (budget.isSpent()) return;
    response.counts[i] = static_cast<std::uint32_t>(nearest.size());
    for (const NearestCuboid& near : nearest) {
      response.distance.push_back(std::max(0.0, near.distance_m - inflation_m));
      response.closest.push_back(toPoint(near.closest_point_map));
      response.direction.push_back(toVector3(near.direction_map));
      response.cuboids.push_back(cuboidMessage(map, near.cuboid, Budget::unlimited()));
    }
  };
  call.readEach(kNearestPoints, points.size(), answer_point);
}

void answer(ServiceCall& call, const FindNearestFree::Request& request,
            FindNearestFree::Response& response) {
  const auto points = call.points(request.points, kPlacePoints);
  const Eigen::Vector3d size_m = call.size(request.size, request.inflation);
  const auto policy = ServiceCall::policy(request.unknown);
  const double max_m = ServiceCall::positive(request.max_distance, "max_distance");
  for (std::size_t i = 0; i < points.size(); ++i) {
    call.requireCells(boxAround(points[i], size_m.array() + 2.0 * max_m));
    response.place[i] = toPoint(points[i]);
  }
  const auto answer_point = [&](const CuboidMap& map, std::size_t i, Budget& budget) {
    const auto place = findNearestFit(map, points[i], size_m, policy, max_m, budget);
    if (!place.isFound()) return;
    response.found[i] = static_cast<std::uint8_t>(true);
    response.place[i] = toPoint(place->center_map);
    response.distance[i] = place->distance_m;
  };
  call.readEach(kPlacePoints, points.size(), answer_point);
  const auto num_without = std::count(response.found.begin(), response.found.end(), 0);
  if (num_without == 0 || !call.info().message.empty()) return;
  call.info().message =
      counted(static_cast<std::uint64_t>(num_without), "point") +
      " without a place for the box within max_distance" +
      (policy == UnknownPolicy::kObstacle ? ": unknown space is an obstacle, unless unknown is 1"
                                          : "");
}

}  // namespace cuboid_mapping_ros
