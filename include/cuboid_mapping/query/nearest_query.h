// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/query/budget.h"

#include <limits>
#include <vector>

namespace cuboid_mapping {

/// A cuboid near a point.
struct NearestCuboid {
  Cuboid cuboid;                      ///< Whole, in cells.
  double distance_m = 0.0;            ///< 0 when the point lies in the cuboid or on its face.
  Eigen::Vector3d closest_point_map;  ///< Point of the cuboid closest to the given one.
  Eigen::Vector3d direction_map;  ///< Unit vector from the given point to it; zero at distance 0.
};

/// The k cuboids nearest to a point (metres, map frame) that pass a filter, nearest first.
///
/// Cases:
///   - fewer than k within max_distance_m: these; perhaps none;
///   - the point need not be in the map; equal distances come in no particular order;
///   - point not finite, k == 0, max_distance_m negative or NaN: none;
///   - the budget is spent: the cuboids found so far, which are the nearest.
///
/// @param budget  Entries are cuboids. @complexity As visitNearest().
[[nodiscard]] std::vector<NearestCuboid> findNearest(
    const CuboidMap& map, const Eigen::Vector3d& point_map, std::size_t k, CuboidFilter filter,
    double max_distance_m = std::numeric_limits<double>::infinity(),
    Budget& budget = Budget::unlimited());

}  // namespace cuboid_mapping
