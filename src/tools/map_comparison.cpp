// SPDX-License-Identifier: BSD-3-Clause
#include "map_comparison.h"

#include <algorithm>
#include <cmath>
#include "cuboid_mapping/map/progress_counter.h"

namespace cuboid_mapping {
namespace {

double countVoxels(const MapSnapshot& map) {
  double num_voxels = 0.0;
  for (const VoxelBrick& brick : map.bricks) num_voxels += brick.voxels.known().count();
  return num_voxels;
}

void compareBricks(const PackedVoxels& first, const PackedVoxels& second, MapAgreement& agreement) {
  const BrickMask known = first.known() & second.known();
  agreement.known_to_both += known.count();
  agreement.class_mismatch += ((first.occupied() ^ second.occupied()) & known).count();
  VoxelValues a;
  VoxelValues b;
  first.getValues(a);
  second.getValues(b);
  known.forEach([&](int voxel) {
    const auto at = static_cast<std::size_t>(voxel);
    agreement.max_log_odds_difference =
        std::max<double>(agreement.max_log_odds_difference, std::abs(a[at] - b[at]));
  });
}

}  // namespace

MapAgreement compareMaps(const MapSnapshot& first, const MapSnapshot& second,
                         const ProgressListener& listener) {
  ProgressCounter progress(listener, first.bricks.size());
  MapAgreement agreement;
  auto other = second.bricks.begin();
  for (const VoxelBrick& brick : first.bricks) {
    while (other != second.bricks.end() && isBeforeOnMortonCurve(other->brick, brick.brick)) {
      ++other;
    }
    if (other != second.bricks.end() && other->brick == brick.brick) {
      compareBricks(brick.voxels, other->voxels, agreement);
    }
    progress.advance();
  }
  agreement.only_in_first = countVoxels(first) - agreement.known_to_both;
  agreement.only_in_second = countVoxels(second) - agreement.known_to_both;
  return agreement;
}

}  // namespace cuboid_mapping
