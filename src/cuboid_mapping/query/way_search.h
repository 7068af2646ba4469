// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/answer.h"
#include "cuboid_mapping/query/budget.h"

namespace cuboid_mapping {

/// Voxels of a search without a region: the bounds of the map and of its ends, with room to go around them.
[[nodiscard]] inline CellBox regionAround(const CuboidMap& map, CellBox ends, const Cell& room) {
  if (const auto& bounds = map.bounds()) ends = unite(ends, *bounds);
  return intersect({ends.min - room, ends.max + room}, kAllCells);
}

/// Searches until what was found holds in the map as it is in the end: others may change the map during a search
/// (MapUnlock), which then has seen two revisions.
/// @param search  () -> Answer<T>. @param holds  (const T&) -> bool; looks at the map without letting others in.
template <typename SearchT, typename HoldsT>
auto searchUntilItHolds(const CuboidMap& map, Budget& budget, const SearchT& search,
                        const HoldsT& holds) -> decltype(search()) {
  while (budget.checkClock()) {
    const std::uint64_t revision = map.revision();
    auto answer = search();
    if (!answer.isFound() || map.revision() == revision || holds(answer.value)) return answer;
  }
  return AnswerStatus::kBudgetSpent;
}

}  // namespace cuboid_mapping
