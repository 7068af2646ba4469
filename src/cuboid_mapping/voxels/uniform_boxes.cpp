// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/voxels/uniform_boxes.h"

#include "cuboid_mapping/voxels/brick_table.h"

namespace cuboid_mapping {
namespace {

/// Boxes that share a cell with a brick.
struct Members {
  Cell brick;
  std::vector<std::uint32_t> boxes;
};

}  // namespace

BricksOfBoxes toBricks(const std::vector<UniformBox>& boxes) {
  BrickTable<Members> members;
  for (std::uint32_t i = 0; i < boxes.size(); ++i) {
    if (boxes[i].box.isEmpty()) continue;
    forEachBrick(boxes[i].box,
                 [&](const Cell& brick) { members.findOrAdd(brick).boxes.push_back(i); });
  }
  BricksOfBoxes result;
  result.bricks.reserve(members.size());
  members.forEach([&](const Members& of_brick) {
    BrickMask known;
    VoxelValues values;
    for (const std::uint32_t i : of_brick.boxes) {
      const CellBox part = intersect(boxes[i].box, brickBox(of_brick.brick));
      const BrickMask mask = BrickMask::ofBox(part);
      if (mask.isFull() && of_brick.boxes.size() == 1) {
        result.bricks.push_back({of_brick.brick, PackedVoxels(mask, boxes[i].log_odds)});
        return;
      }
      if (known.intersects(mask)) result.overlapping = boxes[i].box;
      known |= mask;
      mask.forEach([&](int voxel) { values[static_cast<std::size_t>(voxel)] = boxes[i].log_odds; });
    }
    result.bricks.push_back({of_brick.brick, PackedVoxels(known, values)});
  });
  sortBricks(result.bricks);
  return result;
}

}  // namespace cuboid_mapping
