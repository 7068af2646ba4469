// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/ray_query.h"

#include "cuboid_mapping/rtree/traversal.h"

#include <cmath>

namespace cuboid_mapping {
namespace {

/// A stretch of a ray shorter than this is a touch, or a rounding error, in voxels.
constexpr double kTouch = 1e-9;

}  // namespace

std::optional<RayQueryResult> castRay(const CuboidMap& map, const Eigen::Vector3d& origin_map,
                                      const Eigen::Vector3d& direction, double max_range_m,
                                      UnknownPolicy policy) {
  if (!origin_map.allFinite() || !direction.allFinite() || !std::isfinite(max_range_m) ||
      max_range_m <= 0.0 || direction.isZero(0.0)) {
    return std::nullopt;
  }
  const Eigen::Vector3d unit = direction.stableNormalized();
  const Grid& grid = map.grid();
  const double range = max_range_m / grid.resolution();
  // Distances are in voxels until the end.
  double known_until = 0.0;
  double unknown_length = 0.0;
  double distance = range;
  RayQueryResult result;
  const bool stops_at_unknown = policy == UnknownPolicy::kStop;

  visitRay(map.tree(), grid.toCellUnits(origin_map), unit, range, CuboidFilter::kAll,
           [&](const Cuboid& cuboid, double enter, double leave) {
             if (leave - enter < kTouch) return Visit::kContinue;
             const double gap = enter - known_until;
             if (gap > kTouch) {
               if (stops_at_unknown) return Visit::kStop;
               unknown_length += gap;
             }
             if (cuboid.occupancy() == Occupancy::kOccupied) {
               result.end = RayEnd::kOccupied;
               result.cuboid = cuboid;
               distance = enter;
               return Visit::kStop;
             }
             known_until = std::max(known_until, leave);
             return Visit::kContinue;
           });

  if (result.end != RayEnd::kOccupied && range - known_until > kTouch) {
    if (stops_at_unknown) {
      result.end = RayEnd::kUnknown;
      distance = known_until;
    } else {
      unknown_length += range - known_until;
    }
  }
  result.distance_m = distance * grid.resolution();
  result.unknown_length_m = unknown_length * grid.resolution();
  result.point_map = origin_map + result.distance_m * unit;
  return result;
}

}  // namespace cuboid_mapping
