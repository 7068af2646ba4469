// SPDX-License-Identifier: BSD-3-Clause
#include "octomap_update.h"

namespace cuboid_mapping::bench {

octomap::OcTreeKey toKey(const Cell& cell) {
  constexpr int kCenter = 1 << 15;
  return {static_cast<octomap::key_type>(cell.x + kCenter),
          static_cast<octomap::key_type>(cell.y + kCenter),
          static_cast<octomap::key_type>(cell.z + kCenter)};
}

void updateOctomap(const ScanUpdate& update, octomap::OcTree& tree) {
  for (const BrickUpdate& brick : update.bricks) {
    forEachCell(brick.brick, brick.misses.without(brick.hits),
                [&](const Cell& cell) { tree.updateNode(toKey(cell), false); });
    forEachCell(brick.brick, brick.hits,
                [&](const Cell& cell) { tree.updateNode(toKey(cell), true); });
  }
}

}  // namespace cuboid_mapping::bench
