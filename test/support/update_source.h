// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/scan/scan_update.h"
#include "support/modelled_map.h"

namespace cuboid_mapping::test {

/// Random updates of an area of 4 x 4 x 4 bricks, from clouds and from arbitrary masks.
class UpdateSource {
 public:
  explicit UpdateSource(Random& random) : random_(random), updater_(Grid(0.1)) {}

  ScanUpdate next() {
    ScanShape shape;
    shape.half_edge_m = 1.4;
    shape.num_points = random_.integer(1, 20);
    if (random_.chance(0.4)) return updater_.compute(randomScan(random_, shape));
    if (random_.chance(0.05)) return ScanUpdate{};
    return randomUpdate(random_, {{-2, -2, -2}, {2, 2, 2}}, random_.chance(0.3) ? 12 : 3);
  }

 private:
  Random& random_;
  ScanUpdater updater_;
};

}  // namespace cuboid_mapping::test
