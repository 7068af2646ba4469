// SPDX-License-Identifier: BSD-3-Clause
// Questions of a planner (path, ray, place, corridor) in a room of 4 x 2 x 1 m with a wall across it.
#include <cuboid_mapping/map/mapper.h>
#include <cuboid_mapping/query/corridor_query.h>
#include <cuboid_mapping/query/fit_query.h>
#include <cuboid_mapping/query/path_query.h>
#include <cuboid_mapping/query/ray_query.h>

#include <iostream>

using namespace cuboid_mapping;

namespace {

/// Gives all voxels of a box one class.
void fill(CuboidMap& map, const MetricBox& box, float log_odds) {
  const CellBox cells = map.grid().toCellBox(box).value();
  map.replace(cells, std::vector<UniformBox>{{cells, log_odds}});
}

}  // namespace

int main() {
  MapConfig config;
  config.resolution_m = 0.1;
  CuboidMap map(config);
  fill(map, {{0.0, 0.0, 0.0}, {4.0, 2.0, 1.0}}, map.sensorModel().min());
  fill(map, {{2.0, 0.0, 0.0}, {2.1, 1.2, 1.0}}, map.sensorModel().max());

  const Eigen::Vector3d start(0.5, 0.5, 0.5);
  const Eigen::Vector3d goal(3.5, 0.5, 0.5);
  const Eigen::Vector3d size_m(0.5, 0.5, 0.5);  // The robot, a box that does not rotate.
  const UnknownPolicy unknown = UnknownPolicy::kObstacle;

  Budget budget(QueryLimits{0.1});  // Seconds, for all four questions.
  if (const auto met = checkPath(map, {start, goal}, size_m, unknown, budget); met.isFound()) {
    std::cout << "straight on: blocked after " << met->distance_m << " m\n";
  }
  if (const auto ray = castRay(map, start, {1.0, 0.0, 0.0}, 10.0, unknown, budget); ray.isFound()) {
    std::cout << "ahead: an obstacle in " << ray->distance_m << " m\n";
  }
  const auto place = findNearestFit(map, {2.0, 0.5, 0.5}, size_m, unknown, 2.0, budget);
  if (place.isFound()) {
    std::cout << "nearest place to the wall: " << place->center_map.transpose() << '\n';
  }
  CorridorTask task;
  task.start_map = start;
  task.goal_map = goal;
  task.size_m = size_m;
  const auto corridor = findCorridor(map, task, unknown, budget);
  if (!corridor.isFound()) return 1;
  std::cout << "around it: " << corridor->boxes.size() << " free boxes, " << corridor->length_m
            << " m\n";
}
