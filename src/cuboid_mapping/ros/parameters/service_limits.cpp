// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/parameters/service_limits.h"

#include <algorithm>
#include <sstream>

namespace cuboid_mapping_ros {

using cuboid_mapping::BudgetEnd;

std::size_t maxEntries(const ServiceLimits& limits, std::size_t entry_bytes) {
  const std::size_t max_bytes = static_cast<std::size_t>(limits.max_answer_mb) * 1000000;
  return std::min(static_cast<std::size_t>(limits.max_entries), max_bytes / entry_bytes);
}

std::string explain(BudgetEnd why, const ServiceLimits& limits) {
  std::ostringstream text;
  switch (why) {
    case BudgetEnd::kNone: break;
    case BudgetEnd::kTime:
      text << "ended by its time, at most " << limits.max_time_s << " s (parameter query/max_time)";
      break;
    case BudgetEnd::kBricks:
      text << "ended after " << limits.max_bricks << " bricks (parameter query/max_bricks)";
      break;
    case BudgetEnd::kEntries:
      text << "ended by the size of the answer, at most " << limits.max_entries << " entries and "
           << limits.max_answer_mb << " MB (parameters query/max_entries and query/max_answer)";
      break;
    case BudgetEnd::kStopped: text << "ended because the node stops"; break;
  }
  return text.str();
}

}  // namespace cuboid_mapping_ros
