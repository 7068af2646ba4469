// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace cuboid_mapping {

/// Whether a way is free. Of these, only kFree means that nothing is in it.
enum class WayAnswer : unsigned char {
  kFree,        ///< Nothing is in the way.
  kBlocked,     ///< Something is.
  kInvalid,     ///< The question has no answer, see there.
  kBudgetSpent  ///< There was not enough time to find out.
};

}  // namespace cuboid_mapping
