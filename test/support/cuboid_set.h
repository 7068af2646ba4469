// SPDX-License-Identifier: BSD-3-Clause
// Cuboids as sets that can be compared and printed.
#pragma once

#include "cuboid_mapping/rtree/traversal.h"

#include <algorithm>
#include <ostream>
#include <utility>
#include <vector>

namespace cuboid_mapping {

inline std::ostream& operator<<(std::ostream& out, const Cuboid& cuboid) {
  return out << cuboid.box << ' ' << toString(cuboid.occupancy);
}

inline std::ostream& operator<<(std::ostream& out, const UniformBox& box) {
  return out << box.box << " log-odds " << box.log_odds;
}

namespace test {

/// An arbitrary order of cuboids.
inline bool isBefore(const Cuboid& a, const Cuboid& b) {
  if (a.box.min != b.box.min) return a.box.min < b.box.min;
  if (a.box.max != b.box.max) return a.box.max < b.box.max;
  return a.occupancy < b.occupancy;
}

inline std::vector<Cuboid> sorted(std::vector<Cuboid> cuboids) {
  // As a lambda it is inlined; what is sorted already is common and takes one pass.
  const auto before = [](const Cuboid& a, const Cuboid& b) { return isBefore(a, b); };
  if (!std::is_sorted(cuboids.begin(), cuboids.end(), before)) {
    std::sort(cuboids.begin(), cuboids.end(), before);
  }
  return cuboids;
}

/// All cuboids of a tree, or of a map (include cuboid_search.h), that pass a filter, sorted.
template <typename TreeT>
std::vector<Cuboid> allCuboids(const TreeT& tree, CuboidFilter filter = CuboidFilter::kAll) {
  std::vector<Cuboid> cuboids;
  visitAll(tree, filter, [&](const Cuboid& cuboid) {
    cuboids.push_back(cuboid);
    return Visit::kContinue;
  });
  return sorted(std::move(cuboids));
}

}  // namespace test
}  // namespace cuboid_mapping
