// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/map_snapshot.h"
#include "cuboid_mapping/query/corridor_query.h"

#include <gtest/gtest.h>

#include <string>

namespace cuboid_mapping::test {

/// How a search for a way ended: "found", "start", "goal", "between", "invalid", "spent".
template <typename WayT>
std::string endOf(const Answer<WayT>& way) {
  switch (way.status) {
    case AnswerStatus::kFound: return "found";
    case AnswerStatus::kInvalid: return way.fault.empty() ? "no fault" : "invalid";
    case AnswerStatus::kBudgetSpent: return "spent";
    default: break;
  }
  switch (way.value.blocked) {
    case Blocked::kStart: return "start";
    case Blocked::kGoal: return "goal";
    default: return "between";
  }
}

/// Something occupied appears in the only way while a search lets others change the map: each time at another moment. The
/// search must not find that way then. @param find  (const CuboidMap&, Budget&) -> Answer.
/// @return Number of moments at which it can appear.
template <typename FindT>
int changeDuringSearch(const CuboidMap& before, const CellBox& wall, const FindT& find) {
  for (int change_at = 1;; ++change_at) {
    CuboidMap map = copyOf(before);
    int num_turns = 0;
    MapUnlock turns;
    turns.period_s = 0.0;
    turns.yield = [&] {
      if (++num_turns == change_at) map.replace(wall, {{wall, 1.0F}});
    };
    Budget budget(QueryLimits{}, turns);
    const auto answer = find(map, budget);
    EXPECT_EQ(answer.isFound(), num_turns < change_at) << "after a change at turn " << change_at;
    if (num_turns < change_at) return change_at - 1;
  }
}

}  // namespace cuboid_mapping::test
