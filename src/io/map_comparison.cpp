// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/map_comparison.h"

#include "cuboid_mapping/rtree/traversal.h"

#include <algorithm>
#include <cmath>

namespace cuboid_mapping {
namespace {

double countVoxels(const std::vector<Cuboid>& cuboids) {
  double num_voxels = 0.0;
  for (const Cuboid& cuboid : cuboids) num_voxels += cuboid.box.numVoxels();
  return num_voxels;
}

}  // namespace

MapAgreement compareMaps(const MapSnapshot& first, const MapSnapshot& second,
                         const ProgressListener& listener) {
  ProgressCounter progress(listener, first.cuboids.size());
  MapConfig config;
  config.resolution_m = second.resolution_m;
  CuboidMap map(config);
  map.replace(kAllCells, second.cuboids);
  MapAgreement agreement;
  for (const Cuboid& cuboid : first.cuboids) {
    visitBox(map.tree(), cuboid.box, CuboidFilter::kAll, [&](const Cuboid& other) {
      const double shared = intersect(cuboid.box, other.box).numVoxels();
      agreement.known_to_both += shared;
      if (cuboid.occupancy() != other.occupancy()) agreement.class_mismatch += shared;
      agreement.max_log_odds_difference = std::max<double>(
          agreement.max_log_odds_difference, std::abs(cuboid.log_odds - other.log_odds));
      return Visit::kContinue;
    });
    progress.advance();
  }
  agreement.only_in_first = countVoxels(first.cuboids) - agreement.known_to_both;
  agreement.only_in_second = countVoxels(second.cuboids) - agreement.known_to_both;
  return agreement;
}

}  // namespace cuboid_mapping
