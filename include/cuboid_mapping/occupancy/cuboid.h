// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/cell_box.h"
#include "cuboid_mapping/occupancy/sensor_model.h"

namespace cuboid_mapping {

/// A grid cell of the paper (g_i = (D_i, P(g_i))): a box of voxels with one log-odds.
struct Cuboid {
  CellBox box;
  float log_odds = 0.0F;

  [[nodiscard]] Occupancy occupancy() const { return classify(log_odds); }
};

inline bool operator==(const Cuboid& a, const Cuboid& b) {
  return a.box == b.box && a.log_odds == b.log_odds;
}
inline bool operator!=(const Cuboid& a, const Cuboid& b) { return !(a == b); }

}  // namespace cuboid_mapping
