// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/value_query.h"

#include <algorithm>
#include <optional>

namespace cuboid_mapping {

Answer<double> meanProbability(const CuboidMap& map, const CellBox& box, Budget& budget) {
  double sum = 0.0;
  double num_voxels = 0.0;
  const bool is_visited = visitValues(map, box, budget, [&](float log_odds, int count) {
    sum += count * toProbability(log_odds);
    num_voxels += count;
  });
  if (!is_visited) return AnswerStatus::kBudgetSpent;
  if (num_voxels == 0.0) return AnswerStatus::kNotFound;
  return sum / num_voxels;
}

Answer<float> maxLogOdds(const CuboidMap& map, const CellBox& box, Budget& budget) {
  std::optional<float> greatest;
  const bool is_visited = visitValues(map, box, budget, [&](float log_odds, int /*count*/) {
    greatest = std::max(greatest.value_or(log_odds), log_odds);
  });
  if (!is_visited) return AnswerStatus::kBudgetSpent;
  if (!greatest) return AnswerStatus::kNotFound;
  return *greatest;
}

}  // namespace cuboid_mapping
