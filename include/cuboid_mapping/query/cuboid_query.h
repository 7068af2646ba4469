// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/query/budget.h"

#include <cstddef>
#include <limits>
#include <vector>

namespace cuboid_mapping {

/// Selection of the cuboids of a region.
struct CuboidSelection {
  CuboidFilter filter = CuboidFilter::kAll;  ///< Class of the cuboids.
  std::int32_t min_edge = 1;                 ///< Voxels: cuboids with a shorter edge are left out.
  bool is_clipped = false;  ///< Cut at the faces of the region; min_edge counts before.
  /// Maximum number; with more, the answer is truncated.
  std::size_t max_cuboids = std::numeric_limits<std::size_t>::max();
};

/// Answer of selectCuboids().
struct SelectedCuboids {
  std::vector<Cuboid> cuboids;  ///< Cuboids in cells, in any order.
  bool is_truncated = false;    ///< There are more than max_cuboids, or the budget is spent.
};

/// The cuboids that share a voxel with a region, in no particular order; none for an empty one.
/// @param budget  Entries are cuboids. @complexity As visitBox().
[[nodiscard]] SelectedCuboids selectCuboids(const CuboidMap& map, const CellBox& region,
                                            const CuboidSelection& selection = {},
                                            Budget& budget = Budget::unlimited());

/// The free cuboids of a region, and the faces through which one leads to another.
struct FreeGraph {
  /// Face that two cuboids share, flat: min and max are equal on one axis.
  struct Portal {
    std::uint32_t first;   ///< Number of the cuboid with the lower coordinates on that axis.
    std::uint32_t second;  ///< Number of the other.
    CellBox face;          ///< The whole shared face, in cells.
  };
  std::vector<Cuboid> cuboids;  ///< Clipped to the region.
  std::vector<Portal> portals;  ///< One for each pair of cuboids that share a face.
  /// There are more than max_cuboids, and portals connect the returned ones only; or the budget is spent.
  bool is_truncated = false;
};

/// Free cuboids as nodes, shared faces as portals.
///
/// @param passage  Edges of a box that does not turn, in voxels: a face is a portal if the box passes through
///                 it; {0, 0, 0} for all shared faces. The box need not fit into the cuboids. Passages through
///                 several adjacent faces are not listed: findCorridor() finds them.
/// @param budget  Entries are cuboids and portals.
/// @complexity O(k log n + p) for k cuboids and p portals.
[[nodiscard]] FreeGraph buildFreeGraph(
    const CuboidMap& map, const CellBox& region, const Cell& passage,
    std::size_t max_cuboids = std::numeric_limits<std::size_t>::max(),
    Budget& budget = Budget::unlimited());

}  // namespace cuboid_mapping
