// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/fit_query.h"

#include "cuboid_mapping/query/near_places.h"
#include "cuboid_mapping/query/path_query.h"
#include "cuboid_mapping/query/way_search.h"

#include <cmath>

namespace cuboid_mapping {

Answer<FitPlace> findNearestFit(const CuboidMap& map, const Eigen::Vector3d& point_map,
                                const Eigen::Vector3d& size_m, UnknownPolicy policy,
                                double max_distance_m, Budget& budget) {
  const Grid& grid = map.grid();
  const auto size = grid.toSizeInCells(size_m);
  const bool is_valid = size && std::isfinite(max_distance_m) && max_distance_m >= 0.0 &&
                        grid.toCellBox(boxAround(
                            point_map, size_m + Eigen::Vector3d::Constant(2.0 * max_distance_m)));
  if (!is_valid) {
    return Answer<FitPlace>::invalid(
        "point, size and max_distance must be finite and within the range of the grid, with edges "
        "> "
        "0 and max_distance >= 0");
  }
  const Eigen::Vector3d point_cells = grid.toCellUnits(point_map);
  const Obstacles obstacles(map, policy, budget);
  const auto search = [&]() -> Answer<FitPlace> {
    FitField field(obstacles, *size);
    CellBox allowed = kAllCells;
    if (policy == UnknownPolicy::kObstacle) {  // Nothing fits beyond the known voxels.
      if (!map.bounds()) return AnswerStatus::kNotFound;
      allowed = field.placesIn(*map.bounds());
    }
    const auto found = NearPlaces(field, point_cells, grid.toCellUnits(size_m), allowed)
                           .findNearest(max_distance_m / grid.resolution());
    if (budget.isSpent()) return AnswerStatus::kBudgetSpent;
    if (!found) return AnswerStatus::kNotFound;
    // To the last bit the point itself, if the box fits there.
    const Eigen::Vector3d way_m = grid.toMetres(found->center - point_cells);
    return FitPlace{point_map + way_m, way_m.norm()};
  };
  return searchUntilItHolds(map, budget, search, [&](const FitPlace& place) {
    const auto box = grid.toCellBox(boxAround(place.center_map, size_m));
    return box && !Obstacles(map, policy, Budget::unlimited()).isAny(*box);
  });
}

}  // namespace cuboid_mapping
