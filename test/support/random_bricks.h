// SPDX-License-Identifier: BSD-3-Clause
// Random bricks, and random updates of bricks that no ray walk would give.
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/scan/scan_update.h"
#include "cuboid_mapping/voxels/voxel_store.h"
#include "support/random_shapes.h"
#include "support/voxel_map.h"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace cuboid_mapping::test {

/// The voxels of a brick, one by one.
struct BrickValues {
  Cell brick;
  BrickMask known;
  VoxelValues log_odds;

  [[nodiscard]] VoxelBrick pack() const { return {brick, PackedVoxels(known, log_odds)}; }
};

/// Makes a voxel of a brick known.
inline void setVoxel(BrickValues& brick, const Cell& cell, float log_odds) {
  brick.known.set(voxelIndex(cell));
  brick.log_odds[static_cast<std::size_t>(voxelIndex(cell))] = log_odds;
}

/// A brick with one of several patterns: uniform, noise, or boxes painted over each other.
///
/// Unknown voxels have random log-odds, too: nothing may depend on them.
inline BrickValues randomBrickValues(Random& random) {
  BrickValues brick;
  const Cell group = randomCell(random, {{-100, -100, -100}, {100, 100, 100}});
  brick.brick = {group.x * kBrickEdge, group.y * kBrickEdge, group.z * kBrickEdge};
  const int num_values = random.integer(1, 5);
  const auto random_value = [&] {
    return 0.5F * static_cast<float>(random.integer(0, num_values - 1)) - 1.0F;
  };
  for (float& log_odds : brick.log_odds) log_odds = random_value();
  const CellBox box = brickBox(brick.brick);
  switch (random.integer(0, 3)) {
    case 0: {  // Noise.
      const double known_ratio = random.real(0.0, 1.0);
      visitCells(box, [&](const Cell& cell) {
        if (random.chance(known_ratio)) setVoxel(brick, cell, random_value());
      });
      break;
    }
    case 1:  // All known, few voxels differ.
      visitCells(box, [&](const Cell& cell) {
        setVoxel(brick, cell, random.chance(0.02) ? random_value() : 0.0F);
      });
      break;
    default: {  // Boxes; the last one painted is on top.
      const int num_boxes = random.integer(1, 12);
      for (int i = 0; i < num_boxes; ++i) {
        const float value = random_value();
        visitCells(randomBoxInside(random, box),
                   [&](const Cell& cell) { setVoxel(brick, cell, value); });
      }
    }
  }
  return brick;
}

/// Sets all voxels of a box in the brick's mask. @pre the box lies in the brick.
inline void markBox(BrickMask& mask, const CellBox& box) {
  visitCells(box, [&](const Cell& cell) { mask.set(voxelIndex(cell)); });
}

/// An update of some of the bricks of an area: boxes and single voxels, hits and misses at once.
/// @param area  Area in bricks.
inline ScanUpdate randomUpdate(Random& random, const CellBox& area, int max_bricks) {
  ScanUpdate update;
  const int num_bricks = random.integer(1, max_bricks);
  for (int i = 0; i < num_bricks; ++i) {
    BrickUpdate brick;
    const Cell number = randomCell(random, area);
    brick.brick = {number.x * kBrickEdge, number.y * kBrickEdge, number.z * kBrickEdge};
    const CellBox box = brickBox(brick.brick);
    if (random.chance(0.7))
      markBox(brick.misses, random.chance(0.2) ? box : randomBoxInside(random, box));
    if (random.chance(0.4)) markBox(brick.hits, randomBoxInside(random, box));
    markBox(random.chance(0.5) ? brick.hits : brick.misses,
            CellBox::ofCell(randomCell(random, box)));
    update.bricks.push_back(brick);
  }
  const auto is_same = [](const BrickUpdate& a, const BrickUpdate& b) {
    return a.brick == b.brick;
  };
  sortBricks(update.bricks);
  update.bricks.erase(std::unique(update.bricks.begin(), update.bricks.end(), is_same),
                      update.bricks.end());
  return update;
}

/// A map of some random updates near the origin.
inline CuboidMap mapOfUpdates(Random& random, int max_updates, const MapConfig& config = {}) {
  CuboidMap map(config);
  const int count = random.integer(1, max_updates);
  for (int i = 0; i < count; ++i) map.apply(randomUpdate(random, {{-2, -2, -1}, {2, 2, 1}}, 16));
  return map;
}

}  // namespace cuboid_mapping::test
