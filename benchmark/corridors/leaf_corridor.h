// SPDX-License-Identifier: BSD-3-Clause
// What findCorridor() does, on the leaves of an OctoMap: to be compared with.
#pragma once

#include "cuboid_mapping/geometry/cell_box.h"

#include <octomap/OcTree.h>

#include <cstddef>
#include <vector>

namespace cuboid_mapping::bench {

/// Answer of findLeafCorridor().
struct LeafCorridor {
  bool is_found = false;
  std::vector<CellBox> leaves;  ///< Free ones from start to goal, each beside the one before.
  std::size_t num_reached = 0;  ///< Leaves that the search has come to.
};

/// Finds a corridor of free leaves for a robot of one voxel, by the same A* as findCorridor(): nodes are
/// the free leaves of the pruned tree, their neighbours those with which they share a part of a
/// face; the cost is that from where a leaf is entered to the nearest voxel of the next one.
/// @complexity O(n (log n + depth of the tree)) for n leaves reached.
[[nodiscard]] LeafCorridor findLeafCorridor(const octomap::OcTree& tree, const Cell& start,
                                            const Cell& goal);

/// Leaves as boxes of which successive ones have a voxel in common, so that a path can be pulled tight
/// in them: between two leaves lie the two voxels' thick layer at the face that they share.
[[nodiscard]] std::vector<CellBox> linkLeaves(const std::vector<CellBox>& leaves);

/// Voxels of a box that are in free leaves.
[[nodiscard]] double countFree(const octomap::OcTree& tree, const CellBox& box);

}  // namespace cuboid_mapping::bench
