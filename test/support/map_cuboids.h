// SPDX-License-Identifier: BSD-3-Clause
// The cuboids of maps, also those of waiting bricks, as sets that can be compared.
#pragma once

#include "cuboid_mapping/map/cuboid_search.h"
#include "support/cuboid_set.h"

#include <vector>

namespace cuboid_mapping::test {

/// The cuboids of a map that share a cell with a box, sorted. It divides no brick.
inline std::vector<Cuboid> cuboidsIn(const CuboidMap& map, const CellBox& box) {
  std::vector<Cuboid> cuboids;
  visitBox(map, box, CuboidFilter::kAll, [&](const Cuboid& cuboid) {
    cuboids.push_back(cuboid);
    return Visit::kContinue;
  });
  return sorted(std::move(cuboids));
}

}  // namespace cuboid_mapping::test
