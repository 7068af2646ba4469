// SPDX-License-Identifier: BSD-3-Clause
// What keeps a call of a service from taking the node's time and memory.
#pragma once

#include "cuboid_mapping/query/budget.h"
#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/ros/parameters/service_limits.h"
#include "cuboid_mapping/ros/services/map_in_frame.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>

namespace cuboid_mapping_ros {

/// Reads the map for the answer to a call, in turns with others.
/// @param work  (const CuboidMap&, const ros::Time& stamp, Budget&) -> any.
/// @param max_time_s  Less than that of the limits.
template <typename WorkT>
auto readWithin(const MapInFrame& map, std::size_t entry_bytes, const WorkT& work,
                double max_time_s = std::numeric_limits<double>::infinity()) {
  cuboid_mapping::QueryLimits limits;
  limits.time_s = std::min(map.limits.max_time_s, max_time_s);
  limits.max_bricks = static_cast<std::uint64_t>(map.limits.max_bricks);
  limits.max_entries = maxEntries(map.limits, entry_bytes);
  return map.map.readInTurns(limits, map.is_stopped, work);
}

/// Says in an answer that it was cut short, when the budget is spent. @param advice  What to do.
template <typename ResponseT>
void noteEnd(const MapInFrame& map, const cuboid_mapping::Budget& budget, const std::string& advice,
             ResponseT& response) {
  if (!budget.isSpent()) return;
  response.truncated = static_cast<std::uint8_t>(true);
  response.message = explain(budget.whyEnded(), map.limits) + "; " + advice;
}

/// Answers the entries of a request, one after the other, as far as the budget lasts; for those that
/// are left the response stays as it is.
/// @param name  Of the entries, as "boxes".
/// @param answer  (std::size_t entry): fills in the answer, unless the budget is spent afterwards.
template <typename ResponseT, typename AnswerT>
void answerEach(const MapInFrame& map, std::size_t num_entries, const std::string& name,
                cuboid_mapping::Budget& budget, ResponseT& response, const AnswerT& answer) {
  std::size_t num_answered = 0;
  for (; num_answered < num_entries && budget.lookNow(); ++num_answered) {
    answer(num_answered);
    if (budget.isSpent()) break;
  }
  response.answered = static_cast<std::uint32_t>(num_answered);
  noteEnd(map, budget,
          std::to_string(num_answered) + " of " + std::to_string(num_entries) + ' ' + name +
              " are answered: ask for the rest in another call" +
              (num_answered == 0 ? ", for less at once" : ""),
          response);
}

}  // namespace cuboid_mapping_ros
