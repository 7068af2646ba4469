// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/obstacle_distance.h"

#include "cuboid_mapping/query/obstacles.h"

#include <algorithm>
#include <cmath>

namespace cuboid_mapping {
namespace {

/// The voxels within a distance along each axis, in voxels.
CellBox cellsWithin(const Cell& cell, double reach) {
  CellBox cube;
  for (int axis = 0; axis < 3; ++axis) {
    cube.min[axis] =
        static_cast<std::int32_t>(std::max(cell[axis] - reach, 1.0 * kAllCells.min[axis]));
    cube.max[axis] =
        static_cast<std::int32_t>(std::min(cell[axis] + reach + 1.0, 1.0 * kAllCells.max[axis]));
  }
  return cube;
}

}  // namespace

Answer<ObstacleDistance> findObstacleDistance(const CuboidMap& map,
                                              const Eigen::Vector3d& point_map, double bound_m,
                                              UnknownPolicy policy, Budget& budget) {
  constexpr double kRounding = 1e-6;  // Voxels.
  const auto voxel = map.grid().toCell(point_map);
  const double bound = bound_m * map.grid().inverseResolution() + kRounding;
  if (!voxel || !(bound_m > 0.0)) {
    return Answer<ObstacleDistance>::invalid(
        "the point must be finite and within the range of the grid, and the bound > 0");
  }
  const Obstacles obstacles(map, policy, budget);
  const double farthest = std::min(std::floor(bound), 1.0 * Grid::kMaxCell);
  double nearest = std::numeric_limits<double>::infinity();
  Cell away;
  // Searches growing cubes, until no voxel outside can be nearer.
  for (double reach = std::min(kBrickEdge / 2.0, farthest);;
       reach = std::min(2.0 * reach, farthest)) {
    obstacles.visit(cellsWithin(*voxel, reach), [&](const Cell& obstacle) {
      const Cell from = *voxel - obstacle;
      const double distance = toVector(from).norm();
      if (distance >= nearest || distance > bound) return;
      nearest = distance;
      away = from;
    });
    if (budget.isSpent()) return AnswerStatus::kBudgetSpent;
    if (nearest <= reach || reach == farthest) break;
  }
  if (!std::isfinite(nearest)) return AnswerStatus::kNotFound;
  ObstacleDistance result;
  result.distance_m = map.grid().resolution() * nearest;
  if (nearest > 0.0) result.gradient_map = toVector(away) / nearest;
  return result;
}

}  // namespace cuboid_mapping
