// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/nearest_query.h"

namespace cuboid_mapping {

std::vector<NearestCuboid> findNearest(const CuboidMap& map, const Eigen::Vector3d& point_map,
                                       std::size_t k, CuboidFilter filter, double max_distance_m,
                                       Budget& budget) {
  std::vector<NearestCuboid> nearest;
  if (k == 0 || !point_map.allFinite() || !(max_distance_m >= 0.0)) return nearest;
  if (!budget.spend()) return nearest;
  const Grid& grid = map.grid();
  visitNearest(map, grid.toCellUnits(point_map), max_distance_m / grid.resolution(), filter,
               [&](const Cuboid& cuboid, double distance) {
                 if (!budget.spend() || !budget.addEntries()) return Visit::kStop;
                 const MetricBox box = grid.toMetricBox(cuboid.box);
                 const Eigen::Vector3d closest = point_map.cwiseMax(box.min_m).cwiseMin(box.max_m);
                 nearest.push_back({cuboid, distance * grid.resolution(), closest,
                                    (closest - point_map).stableNormalized()});
                 return nearest.size() < k ? Visit::kContinue : Visit::kStop;
               });
  return nearest;
}

}  // namespace cuboid_mapping
