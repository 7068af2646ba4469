// SPDX-License-Identifier: BSD-3-Clause
// Searches of the cuboids of a map with a visitor. Thread-safe beside each other, not beside a change.
#pragma once

#include "cuboid_mapping/geometry/function_ref.h"
#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/occupancy/cuboid_filter.h"

#include <Eigen/Core>

#include <cstddef>

namespace cuboid_mapping {

/// Visits the cuboids that share a cell with the window, in no particular order.
/// @complexity O(log n + k) for k cuboids of the leaf nodes in the window; more if MBRs of nodes overlap.
void visitBox(const CuboidMap& map, const CellBox& window, CuboidFilter filter,
              FunctionRef<Visit(const Cuboid&)> visit);

/// Visits all cuboids that pass the filter, in no particular order.
/// @complexity O(n); for kOccupied O(leaf nodes with an occupied cuboid).
void visitAll(const CuboidMap& map, CuboidFilter filter, FunctionRef<Visit(const Cuboid&)> visit);

/// Visits the cuboids by their distance from a point, nearest first (G. Hjaltason, H. Samet, 1999).
///
/// @param point  In units of cells.
/// @param max_distance  Cuboids farther away are left out, in units of cells.
/// @param visit  Gets the distance in cells, too; it is 0 inside.
/// @complexity O((k + log n) log n) for k cuboids of the visited leaf nodes.
void visitNearest(const CuboidMap& map, const Eigen::Vector3d& point, double max_distance,
                  CuboidFilter filter, FunctionRef<Visit(const Cuboid&, double)> visit);

/// Numbers of cuboids of a map.
struct CuboidCounts {
  std::size_t free = 0;      ///< Cuboids of free voxels.
  std::size_t occupied = 0;  ///< Cuboids of occupied voxels.

  /// Cuboids of both classes.
  [[nodiscard]] std::size_t total() const { return free + occupied; }
};

/// Counts the cuboids of a map. @complexity O(n).
[[nodiscard]] CuboidCounts countCuboids(const CuboidMap& map);

/// Size of the R-tree of a map.
struct TreeSize {
  int height = 0;               ///< Levels, leaf nodes included; 0 for an empty map.
  std::size_t leaf_nodes = 0;   ///< Bricks with a known voxel.
  std::size_t inner_nodes = 0;  ///< Nodes above them.
  std::size_t num_bytes = 0;    ///< Size of the nodes, without bricks.
};

/// Size of the R-tree of a map. @complexity O(1).
[[nodiscard]] TreeSize measureTree(const CuboidMap& map);

}  // namespace cuboid_mapping
