// SPDX-License-Identifier: BSD-3-Clause
// Example:
//     const Eigen::Vector3d point_map(1.0, 0.5, 0.5);
//     const auto occupied = CuboidFilter::kOccupied;
//     const auto nearest = findNearest(map, point_map, 3, occupied, Budget::unlimited());
//     for (const NearestCuboid& near : nearest.value) std::cout << near.distance_m << " m\n";
#pragma once

#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/query/answer.h"
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
///   - fewer than k within max_distance_m: these; kNotFound without any;
///   - the point need not be in the map; equal distances come in no particular order;
///   - point not finite, k == 0, max_distance_m negative or NaN: kInvalid;
///   - kBudgetSpent: with the cuboids found so far, which are the nearest.
///
/// @param budget  Entries are cuboids. @complexity As visitNearest().
Answer<std::vector<NearestCuboid>> findNearest(
    const CuboidMap& map, const Eigen::Vector3d& point_map, std::size_t k, CuboidFilter filter,
    Budget& budget, double max_distance_m = std::numeric_limits<double>::infinity());

}  // namespace cuboid_mapping
