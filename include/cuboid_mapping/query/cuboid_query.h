// SPDX-License-Identifier: BSD-3-Clause
// Example:
//     CuboidSelection selection;
//     selection.filter = CuboidFilter::kOccupied;
//     const auto walls = selectCuboids(map, kAllCells, selection, Budget::unlimited());
//     for (const Cuboid& wall : walls.value) std::cout << wall.box << '\n';
//     const auto graph = buildFreeGraph(map, kAllCells, {5, 5, 5}, Budget::unlimited());
#pragma once

#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/query/answer.h"
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
  /// Maximum number; with more, the answer is kBudgetSpent.
  std::size_t max_cuboids = std::numeric_limits<std::size_t>::max();
};

/// The cuboids that share a voxel with a region, in cells, in any order; none for an empty one. kBudgetSpent has
/// some of them.
/// @param budget  Entries are cuboids. @complexity As visitBox().
Answer<std::vector<Cuboid>> selectCuboids(const CuboidMap& map, const CellBox& region,
                                          const CuboidSelection& selection, Budget& budget);

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
};

/// Free cuboids as nodes, shared faces as portals.
///
/// @param passage  Edges of a box that does not turn, in voxels: a face is a portal if the box passes through
///                 it; {0, 0, 0} for all shared faces. The box need not fit into the cuboids. Passages through
///                 several adjacent faces are not listed: findCorridor() finds them.
/// @param budget  Entries are cuboids and portals.
/// @param max_cuboids  If there are more: kBudgetSpent, with portals between the returned ones.
/// @return  kBudgetSpent with some cuboids and portals.
/// @complexity O(k log n + p) for k cuboids and p portals.
Answer<FreeGraph> buildFreeGraph(const CuboidMap& map, const CellBox& region, const Cell& passage,
                                 Budget& budget,
                                 std::size_t max_cuboids = std::numeric_limits<std::size_t>::max());

}  // namespace cuboid_mapping
