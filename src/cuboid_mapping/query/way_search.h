// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/box_faces.h"
#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/answer.h"
#include "cuboid_mapping/query/budget.h"
#include "cuboid_mapping/query/unknown_policy.h"

#include <optional>

namespace cuboid_mapping {

/// Voxels of a search: those of its region; without one, the bounds of the map and of its ends, with room to go around
/// them. If unknown space is free, the ends alone bound the heights: maps end above walls that a robot on the ground
/// does not cross, and a planar laser sees one layer of them.
[[nodiscard]] inline CellBox searchRegion(const std::optional<CellBox>& region,
                                          const CuboidMap& map, const CellBox& ends,
                                          const Cell& room, UnknownPolicy policy) {
  if (region) return intersect(*region, kAllCells);
  CellBox all = ends;
  if (const auto& bounds = map.bounds()) all = unite(all, *bounds);
  if (policy == UnknownPolicy::kFree) {
    all.min.z = ends.min.z;
    all.max.z = ends.max.z;
  }
  return intersect(dilate(all, room), kAllCells);
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
