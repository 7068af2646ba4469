// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/query/corridor_query.h"

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

}  // namespace cuboid_mapping::test
