// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/nearest_query.h"

#include <utility>

namespace cuboid_mapping {

Answer<std::vector<NearestCuboid>> findNearest(const CuboidMap& map,
                                               const Eigen::Vector3d& point_map, std::size_t k,
                                               CuboidFilter filter, Budget& budget,
                                               double max_distance_m) {
  if (k == 0 || !point_map.allFinite() || !(max_distance_m >= 0.0)) {
    return Answer<std::vector<NearestCuboid>>::invalid(
        "the point must be finite, k > 0, and max_distance >= 0");
  }
  std::vector<NearestCuboid> nearest;
  if (!budget.spend()) return AnswerStatus::kBudgetSpent;
  bool is_complete = true;
  const Grid& grid = map.grid();
  visitNearest(map, grid.toCellUnits(point_map), max_distance_m / grid.resolution(),
               withinBudget(filter), [&](const Cuboid& cuboid, double distance) {
                 is_complete = budget.spend() && (!matches(filter, cuboid) || budget.addEntries());
                 if (!is_complete) return Visit::kStop;
                 if (!matches(filter, cuboid)) return Visit::kContinue;
                 const MetricBox box = grid.toMetricBox(cuboid.box);
                 const Eigen::Vector3d closest = point_map.cwiseMax(box.min_m).cwiseMin(box.max_m);
                 nearest.push_back({cuboid, distance * grid.resolution(), closest,
                                    (closest - point_map).stableNormalized()});
                 return nearest.size() < k ? Visit::kContinue : Visit::kStop;
               });
  return answerWithAll(std::move(nearest), is_complete);
}

}  // namespace cuboid_mapping
