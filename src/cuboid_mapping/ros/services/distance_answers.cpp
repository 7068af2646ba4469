// SPDX-License-Identifier: BSD-3-Clause
// Answers about distances to obstacles, and about frontiers.
#include "cuboid_mapping/query/frontier_query.h"
#include "cuboid_mapping/query/obstacle_distance.h"
#include "cuboid_mapping/query/path_query.h"
#include "cuboid_mapping/ros/services/answers.h"

namespace cuboid_mapping_ros {
namespace {

constexpr Entries kDistancePoints{"points", 32};
constexpr std::size_t kFrontierBytes = 61;

FrontierTask readTask(ServiceCall& call, const GetFrontiers::Request& request) {
  FrontierTask task;
  task.size_m = call.size(request.size, request.inflation);
  task.min_voxels = request.min_voxels;
  task.max_distance_m = ServiceCall::notNegative(request.max_distance, "max_distance");
  task.view_range_m = ServiceCall::notNegative(request.view_range, "view_range");
  const double max_view_m = FrontierTask::kMaxViewRange * call.resolution();
  if (task.view_range_m > max_view_m) {
    throw Refusal("view_range is " + std::to_string(task.view_range_m) + " m: at most " +
                  std::to_string(max_view_m) + " m (500 voxels) can be looked through");
  }
  if (request.everything == 0) task.region = call.box(request.region, 0.0, {"region"});
  call.requireLoaded(task.region);
  return task;
}

}  // namespace

void answer(ServiceCall& call, const GetDistances::Request& request,
            GetDistances::Response& response) {
  const auto policy = ServiceCall::policy(request.unknown);
  const auto points = call.points(request.points, kDistancePoints);
  const double max_m = ServiceCall::positive(request.max_distance, "max_distance");
  const Eigen::Vector3d around_m = Eigen::Vector3d::Constant(2.0 * (max_m + call.resolution()));
  for (const Eigen::Vector3d& point : points) {
    call.requireCells(boxAround(point, around_m));
  }
  response.distance.assign(points.size(), 0.0);
  response.gradient.resize(points.size());
  call.readEach(kDistancePoints, points.size(),
                [&](const CuboidMap& map, std::size_t i, Budget& budget) {
                  const auto found = findObstacleDistance(map, points[i], max_m, policy, budget);
                  if (!found) return;
                  response.distance[i] = found->distance_m;
                  response.gradient[i] = toVector3(found->gradient_map);
                });
}

void answer(ServiceCall& call, const GetFrontiers::Request& request,
            GetFrontiers::Response& response) {
  const FrontierTask task = readTask(call, request);
  call.read(kFrontierBytes, [&](const CuboidMap& map, Budget& budget) {
    const auto found = findFrontiers(map, task, budget);
    if (!found.is_valid) {
      throw Refusal("size or max_distance is larger than any map: give the robot's in metres");
    }
    for (const Frontier& frontier : found.frontiers) {
      response.center.push_back(toPoint(frontier.center_map));
      response.found.push_back(static_cast<std::uint8_t>(frontier.place_map.has_value()));
      response.place.push_back(toPoint(frontier.place_map.value_or(frontier.center_map)));
      response.unknown_volume.push_back(frontier.unknown_volume_m3);
      response.counts.push_back(static_cast<std::uint32_t>(frontier.voxels.size()));
      if (request.with_voxels == 0 || !budget.addEntries(frontier.voxels.size())) continue;
      for (const Cell& cell : frontier.voxels) {
        response.voxels.push_back(toPoint(map.grid().centerOf(CellBox::ofCell(cell))));
      }
    }
    call.noteEnd(budget, "ask for a smaller region, or for larger clusters");
  });
}

}  // namespace cuboid_mapping_ros
