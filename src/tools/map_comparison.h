// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/map_snapshot.h"
#include "cuboid_mapping/map/progress_listener.h"

namespace cuboid_mapping {

/// Agreement of two maps, in voxels.
struct MapAgreement {
  double known_to_both = 0.0;
  double only_in_first = 0.0;
  double only_in_second = 0.0;
  double class_mismatch = 0.0;           ///< Voxels free in one map and occupied in the other.
  double max_log_odds_difference = 0.0;  ///< Maximum over all voxels known to both.

  /// Whether the same voxels are known, with the same classes.
  [[nodiscard]] bool isSameByClass() const {
    return only_in_first == 0.0 && only_in_second == 0.0 && class_mismatch == 0.0;
  }
};

/// Compares every voxel that is known to either. @pre findFault() finds none in either, and the
/// resolutions are equal. @param listener  Reports bricks of the first.
/// @complexity O(n).
[[nodiscard]] MapAgreement compareMaps(const MapSnapshot& first, const MapSnapshot& second,
                                       const ProgressListener& listener = {});

}  // namespace cuboid_mapping
