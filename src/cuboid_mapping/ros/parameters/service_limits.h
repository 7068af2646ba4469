// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/query/budget.h"

#include <cstddef>
#include <string>

namespace cuboid_mapping_ros {

/// Treatment of calls about parts of the map on disk, see MapWindow.
enum class QueriesOutside : unsigned char {
  kRefuse,  ///< The call is refused.
  kLoad     ///< The parts are loaded first.
};

/// Limits of one service call.
struct ServiceLimits {
  double max_time_s = 5.0;  ///< Time from when it has the map.
  /// Bricks of 8 x 8 x 8 voxels, cuboids and similar items that it reads.
  int max_bricks = 20000000;
  int max_entries = 1000000;  ///< Maximum number of entries of a request, and of its answer.
  int max_answer_mb = 100;    ///< Maximum size of an answer, MB.
  QueriesOutside outside = QueriesOutside::kRefuse;
};

/// Maximum number of entries of an answer. @param entry_bytes  Size of an entry, > 0.
[[nodiscard]] std::size_t maxEntries(const ServiceLimits& limits, std::size_t entry_bytes);

/// Text such as "ended after 5 s (parameter query/max_time)". @pre why is not kNone.
[[nodiscard]] std::string explain(cuboid_mapping::BudgetEnd why, const ServiceLimits& limits);

}  // namespace cuboid_mapping_ros
