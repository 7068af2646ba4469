// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/query/budget.h"

#include <cstddef>
#include <limits>
#include <vector>

namespace cuboid_mapping {

/// Which cuboids of a region are wanted, and how.
struct CuboidSelection {
  CuboidFilter filter = CuboidFilter::kAll;  ///< Class of the cuboids.
  std::int32_t min_edge = 1;                 ///< Voxels: cuboids with a shorter edge are left out.
  bool is_clipped = false;  ///< Cut at the faces of the region, after the look at the edges.
  /// If there are more, the answer is truncated.
  std::size_t max_cuboids = std::numeric_limits<std::size_t>::max();
};

/// Answer of selectCuboids.
struct SelectedCuboids {
  std::vector<Cuboid> cuboids;  ///< Cuboids in cells, in any order.
  bool is_truncated = false;    ///< There are more than max_cuboids, or the budget is spent.
};

/// The cuboids that share a voxel with a region, in no particular order; none for an empty one.
/// @complexity As visitBox(); at most one cuboid more than max_cuboids is visited.
[[nodiscard]] SelectedCuboids selectCuboids(const CuboidMap& map, const CellBox& region,
                                            const CuboidSelection& selection = {},
                                            Budget& budget = Budget::unlimited());

/// The free cuboids of a region and where one can go from one to another.
struct FreeGraph {
  /// Face that two cuboids share, flat: min and max are equal on one axis.
  struct Portal {
    std::uint32_t first;   ///< Number of the cuboid with the lower coordinates on that axis.
    std::uint32_t second;  ///< Number of the other.
    CellBox face;          ///< All that they share, in cells.
  };
  std::vector<Cuboid> cuboids;  ///< Clipped to the region.
  std::vector<Portal> portals;  ///< One for each pair of cuboids.
  /// There are more than max_cuboids, and portals connect the returned ones only; or the budget is spent.
  bool is_truncated = false;
};

/// Free cuboids as nodes, shared faces as portals.
///
/// @param passage  Edges of a box, in voxels: a face is a portal when the box, which does not turn,
///                 passes through it; {0, 0, 0} for all shared faces. It says nothing of whether the
///                 box fits into the cuboids: a passage through several faces side by side, which
///                 findCorridor() finds, is not told.
/// @param budget  Entries are cuboids and portals.
/// @complexity O(k log n) for k cuboids.
[[nodiscard]] FreeGraph buildFreeGraph(
    const CuboidMap& map, const CellBox& region, const Cell& passage,
    std::size_t max_cuboids = std::numeric_limits<std::size_t>::max(),
    Budget& budget = Budget::unlimited());

}  // namespace cuboid_mapping
