// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/rtree/rtree.h"

#include <functional>
#include <string>
#include <vector>

namespace cuboid_mapping {

/// Every way in which inner nodes are not those of an R-tree of their order; empty when they are.
///
/// Checked: branches of a node within (d, M), the root with at least two; all leaf nodes at one level;
/// parents; every branch is the minimum bounding box of its child, and tells whether something below
/// is occupied; the number of nodes. @param leaf_summary  What a leaf node's branch has to be; its
/// child does not count. @complexity O(n). For tests.
[[nodiscard]] std::vector<std::string> checkNodes(
    const InnerTree& tree, const std::function<Branch(NodeIndex)>& leaf_summary);

/// As above, of a tree of cuboids: leaf nodes have d to M cuboids, too, unless there is only one.
[[nodiscard]] std::vector<std::string> checkTree(const RTree& tree);

/// Every pair of cuboids that share a cell. @complexity O(n log n) for few. For tests.
[[nodiscard]] std::vector<std::string> checkDisjoint(const RTree& tree);

}  // namespace cuboid_mapping
