// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/query/budget.h"

#include <cstddef>
#include <string>

namespace cuboid_mapping_ros {

/// Treatment of calls about parts of the map that are on disk only, see MapWindow.
enum class QueriesOutside : unsigned char {
  kRefuse,  ///< It is refused.
  kLoad     ///< They are brought back first.
};

/// How much one call of a service may do.
struct ServiceLimits {
  double max_time_s = 5.0;  ///< From when it has the map on.
  /// Bricks of 8 x 8 x 8 voxels, cuboids and the like that it looks at.
  int max_bricks = 20000000;
  int max_entries = 1000000;  ///< Most entries of a request, and of its answer.
  int max_answer_mb = 100;    ///< Largest answer, MB.
  QueriesOutside outside = QueriesOutside::kRefuse;
};

/// Entries that an answer may have. @param entry_bytes  Of each, > 0.
[[nodiscard]] std::size_t maxEntries(const ServiceLimits& limits, std::size_t entry_bytes);

/// As "ended after 5 s (parameter query/max_time)". @pre why is not kNone.
[[nodiscard]] std::string explain(cuboid_mapping::BudgetEnd why, const ServiceLimits& limits);

}  // namespace cuboid_mapping_ros
