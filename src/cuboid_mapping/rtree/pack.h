// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/rtree/node.h"

#include <vector>

namespace cuboid_mapping {

/// How many groups of how many branches to make.
struct PackShape {
  std::size_t num_groups;
  std::size_t fewest;  ///< Branches of a group.
  std::size_t most;    ///< Branches of a group.
};

/// Orders branches so that groups of neighbours lie one after the other, by recursive cuts along
/// the longest axis: into halves while there are many groups, then where the two sides share least
/// volume.
///
/// @return the end of each group in `branches`, in rising order.
/// @pre num_groups >= 1 and num_groups * fewest <= branches.size() <= num_groups * most.
/// @complexity O(n log n log num_groups). Pure.
[[nodiscard]] std::vector<std::size_t> packBranches(std::vector<Branch>& branches,
                                                    const PackShape& shape);

}  // namespace cuboid_mapping
