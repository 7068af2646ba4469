// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/scan/scan_update.h"

#include <sstream>
#include <string>

namespace cuboid_mapping::test {

/// The first difference in what two updates observe; empty if there is none. A miss in a hit voxel is none.
inline std::string findDifference(const ScanUpdate& a, const ScanUpdate& b) {
  if (a.num_points != b.num_points || a.num_out_of_range != b.num_out_of_range ||
      a.num_too_far != b.num_too_far) {
    return "other numbers of points";
  }
  if (a.bricks.size() != b.bricks.size()) return "another number of bricks";
  for (std::size_t i = 0; i < a.bricks.size(); ++i) {
    const BrickUpdate& of_a = a.bricks[i];
    const BrickUpdate& of_b = b.bricks[i];
    if (of_a.brick == of_b.brick && of_a.hits == of_b.hits && of_a.grazes == of_b.grazes &&
        of_a.misses.without(of_a.hits) == of_b.misses.without(of_b.hits)) {
      continue;
    }
    std::ostringstream text;
    text << "brick " << of_a.brick << " or " << of_b.brick;
    return text.str();
  }
  return "";
}

}  // namespace cuboid_mapping::test
