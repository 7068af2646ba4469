// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace cuboid_mapping {

/// Order (d, M) of an R-tree: bounds of the number of branches of a node (paper, Section III).
struct RTreeConfig {
  /// Greatest M: a set of branches is one word.
  static constexpr int kMaxBranchesLimit = 64;

  int max_branches = 32;  ///< M: 4 to kMaxBranchesLimit.
  int min_branches = 12;  ///< d: 2 to M / 2. The root may have fewer.
};

}  // namespace cuboid_mapping
