// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace cuboid_mapping {

/// Whether a way is free. Only kFree means that nothing is in it.
enum class WayAnswer : unsigned char {
  kFree,        ///< Nothing is in the way.
  kBlocked,     ///< An obstacle is in the way.
  kInvalid,     ///< The request is invalid, see the query.
  kBudgetSpent  ///< The budget was spent before there was an answer.
};

}  // namespace cuboid_mapping
