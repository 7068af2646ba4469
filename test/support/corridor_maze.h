// SPDX-License-Identifier: BSD-3-Clause
// A map for searches of ways.
#pragma once

#include "support/modelled_map.h"

#include <optional>
#include <vector>

namespace cuboid_mapping::test {

constexpr CellBox kMazeArea{{-20, -20, -6}, {20, 20, 6}};

/// Walls with gaps about as wide as the robot, some clutter, unknown patches.
inline ModelledMap randomMaze(Random& random) {
  MapConfig config;
  config.resolution_m = 1.0;
  ModelledMap maze(config);
  const auto fill = [&](const CellBox& asked, const std::optional<float>& log_odds) {
    const CellBox box = intersect(asked, kMazeArea);
    if (box.isEmpty()) return;
    std::vector<UniformBox> boxes;
    if (log_odds) boxes.push_back({box, *log_odds});
    maze.map.replace(box, boxes);
    visitCells(box, [&](const Cell& cell) { maze.voxels.set(cell, log_odds); });
  };
  fill(kMazeArea, -1.0F);
  for (int axis = 0; axis < 2; ++axis) {
    for (int at = -12; at <= 12; at += random.integer(5, 9)) {
      CellBox wall = kMazeArea;
      wall.min[axis] = at;
      wall.max[axis] = at + random.integer(1, 2);
      fill(wall, 1.0F);
    }
  }
  const int num_doors = random.integer(15, 50);
  for (int i = 0; i < num_doors; ++i) {
    const Cell min = randomCell(random, kMazeArea);
    fill({min, min + Cell{random.integer(2, 7), random.integer(2, 7), random.integer(2, 8)}},
         -1.5F);
  }
  const int num_clutter = random.integer(0, 15);
  for (int i = 0; i < num_clutter; ++i) {
    fill(randomBox(random, kMazeArea, 3),
         random.chance(0.3) ? std::nullopt : std::optional<float>(1.0F));
  }
  return maze;
}

}  // namespace cuboid_mapping::test
