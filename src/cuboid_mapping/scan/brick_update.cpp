// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/brick_update.h"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace cuboid_mapping {

bool isOrdered(const std::vector<BrickUpdate>& bricks) {
  return std::adjacent_find(bricks.begin(), bricks.end(),
                            [](const BrickUpdate& a, const BrickUpdate& b) {
                              return !isBeforeOnMortonCurve(a.brick, b.brick);
                            }) == bricks.end();
}

std::vector<BrickUpdate> ordered(std::vector<BrickUpdate> bricks) {
  sortBricks(bricks);
  std::size_t count = 0;
  for (const BrickUpdate& brick : bricks) {
    if (count == 0 || bricks[count - 1].brick != brick.brick) {
      bricks[count++] = brick;
      continue;
    }
    bricks[count - 1].hits |= brick.hits;
    bricks[count - 1].misses |= brick.misses;
    bricks[count - 1].grazes |= brick.grazes;
  }
  bricks.resize(count);
  return bricks;
}

ScanUpdate unite(ScanUpdate first, const ScanUpdate& second) {
  first.bricks.insert(first.bricks.end(), second.bricks.begin(), second.bricks.end());
  first.bricks = ordered(std::move(first.bricks));
  first.samples.insert(first.samples.end(), second.samples.begin(), second.samples.end());
  first.num_points += second.num_points;
  first.num_out_of_range += second.num_out_of_range;
  first.num_too_far += second.num_too_far;
  return first;
}

}  // namespace cuboid_mapping
