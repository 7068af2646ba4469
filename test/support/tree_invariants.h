// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/rtree/rtree.h"

#include <string>
#include <vector>

namespace cuboid_mapping {

/// Every way in which a tree is not an R-tree of its order; empty when it is one.
///
/// Checked: branches of a node within (d, M), the root with at least two unless it is a leaf; all
/// leaves at one level; parents; every inner branch is the minimum bounding box of its
/// child, and tells whether something below is occupied; no leaf wide without need; number of cuboids and of nodes.
/// @complexity O(n). For tests.
[[nodiscard]] std::vector<std::string> checkTree(const RTree& tree);

/// Every pair of cuboids that share a cell. @complexity O(n log n) for few. For tests.
[[nodiscard]] std::vector<std::string> checkDisjoint(const RTree& tree);

}  // namespace cuboid_mapping
