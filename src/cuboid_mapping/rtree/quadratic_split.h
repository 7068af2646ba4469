// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/rtree/node.h"

#include <vector>

namespace cuboid_mapping {

/// The two groups into which an overfull node is split.
struct SplitGroups {
  std::vector<Branch> first;
  std::vector<Branch> second;
};

/// Guttman's quadratic split: the two branches that would waste most volume together start the
/// groups; then the branch with the clearest preference goes to the group that it expands least.
///
/// @param branches  At least 2 * min_branches.
/// @param min_branches  Each group gets at least as many (d of the paper).
/// @complexity O(n^2). Pure. A. Guttman, "R-trees", 1984, Section 3.5.2.
[[nodiscard]] SplitGroups splitQuadratic(const std::vector<Branch>& branches, int min_branches);

}  // namespace cuboid_mapping
