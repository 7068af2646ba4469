// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/rtree/rtree.h"

#include <vector>

namespace cuboid_mapping {

/// Figures of one level of a tree.
struct LevelStatistics {
  std::size_t num_nodes = 0;
  std::size_t num_branches = 0;
  double fill_ratio = 0.0;  ///< Branches over places for branches.
  /// Volume that sibling branches share, summed over pairs, over the volume of all branches.
  double overlap_ratio = 0.0;
};

/// Figures of a tree.
struct TreeStatistics {
  std::vector<LevelStatistics> levels;  ///< Leaves first.
  std::size_t num_cuboids = 0;
  std::size_t num_bytes = 0;  ///< Held from the allocator for nodes.
};

/// @complexity O(n M).
[[nodiscard]] TreeStatistics computeStatistics(const RTree& tree);

}  // namespace cuboid_mapping
