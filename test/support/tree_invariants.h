// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "evaluation/rtree.h"

#include <functional>
#include <string>
#include <vector>

namespace cuboid_mapping {

/// All violations of an R-tree of its order in inner nodes; empty if there are none.
///
/// Checked: branches of a node within (d, M), the root with at least two; all leaf nodes at one level;
/// parents; every branch has the minimum bounding box of its child, and tells whether a cuboid below
/// is occupied; the number of nodes. @param leaf_summary  Expected branch of a leaf node; its
/// child does not count. @complexity O(n). For tests.
[[nodiscard]] std::vector<std::string> checkNodes(
    const InnerTree& tree, const std::function<Branch(NodeIndex)>& leaf_summary);

/// As above, for a tree of cuboids: leaf nodes have d to M cuboids, too, unless there is only one.
[[nodiscard]] std::vector<std::string> checkTree(const bench::RTree& tree);

/// Pairs of cuboids that share a cell. @complexity O(n log n) for few. For tests.
[[nodiscard]] std::vector<std::string> checkDisjoint(const bench::RTree& tree);

}  // namespace cuboid_mapping
