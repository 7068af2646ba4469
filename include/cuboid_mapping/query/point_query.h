// SPDX-License-Identifier: BSD-3-Clause
// Example:
//     const std::optional<Cuboid> cuboid = findCuboid(map, {1, 2, 3});  // Metres.
//     const std::optional<Cuboid> of_cell = findCuboidOfCell(map, {1, 2, 3});
//     if (!cuboid) std::cout << "unknown\n";
//     if (of_cell) std::cout << "free from " << of_cell->box << '\n';
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"

#include <optional>

namespace cuboid_mapping {

/// The cuboid that holds a point (metres, map frame).
///
/// Cases:
///   - unknown space, outside the map, out of the grid's range, NaN: nothing;
///   - on a face between two voxels: the one with the greater coordinates, as boxes are half-open.
///
/// @complexity As visitBox() for one voxel. Corresponds to octomap::OcTreeBaseImpl::search.
[[nodiscard]] std::optional<Cuboid> findCuboid(const CuboidMap& map,
                                               const Eigen::Vector3d& point_map);

/// The cuboid that holds a voxel; nothing when it is unknown.
[[nodiscard]] std::optional<Cuboid> findCuboidOfCell(const CuboidMap& map, const Cell& cell);

/// Class of the voxel that holds a point; kUnknown where findCuboid() gives nothing.
/// @complexity O(1) on average.
[[nodiscard]] Occupancy classifyPoint(const CuboidMap& map, const Eigen::Vector3d& point_map);

}  // namespace cuboid_mapping
