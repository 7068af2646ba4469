// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/occupancy/cuboid.h"

namespace cuboid_mapping {

/// Answer of a visitor: go on with the search, or end it.
enum class Visit : unsigned char { kContinue, kStop };

/// Cuboids that a search visits. For kOccupied, subtrees without any are skipped.
enum class CuboidFilter : unsigned char { kAll, kFree, kOccupied };

/// Whether a cuboid passes a filter.
[[nodiscard]] constexpr bool matches(CuboidFilter filter, const Cuboid& cuboid) {
  return filter == CuboidFilter::kAll || cuboid.isOccupied() == (filter == CuboidFilter::kOccupied);
}

/// Filter for a search whose visitor asks matches(), and has a budget: a search for free cuboids would pass any number
/// of occupied ones without a look at it.
[[nodiscard]] constexpr CuboidFilter withinBudget(CuboidFilter filter) {
  return filter == CuboidFilter::kFree ? CuboidFilter::kAll : filter;
}

}  // namespace cuboid_mapping
