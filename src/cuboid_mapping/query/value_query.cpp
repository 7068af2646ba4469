// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/value_query.h"

#include <algorithm>

namespace cuboid_mapping {

std::optional<double> meanProbability(const CuboidMap& map, const CellBox& box, Budget& budget) {
  double sum = 0.0;
  double num_voxels = 0.0;
  visitValues(
      map, box,
      [&](float log_odds, int count) {
        sum += count * toProbability(log_odds);
        num_voxels += count;
      },
      budget);
  if (num_voxels == 0.0) return std::nullopt;
  return sum / num_voxels;
}

std::optional<float> maxLogOdds(const CuboidMap& map, const CellBox& box, Budget& budget) {
  std::optional<float> greatest;
  visitValues(
      map, box,
      [&](float log_odds, int /*count*/) {
        greatest = std::max(greatest.value_or(log_odds), log_odds);
      },
      budget);
  return greatest;
}

}  // namespace cuboid_mapping
