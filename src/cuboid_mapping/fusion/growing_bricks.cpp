// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/growing_bricks.h"

#include "cuboid_mapping/voxels/brick_store.h"

#include <algorithm>

namespace cuboid_mapping {

GrowingBricks::GrowingBricks(const GrownBricks& grown, const VoxelStore& voxels,
                             const VoxelStore::PendingChange& change,
                             const FusionThresholds& thresholds)
    : grown_(grown), voxels_(voxels), thresholds_(thresholds) {
  copies_.reserve(change.changed.size());
  for (const std::uint32_t i : change.changed) {
    copy(change.bricks[i].brick, &change.bricks[i].voxels);
  }
}

GrowingBrick& GrowingBricks::findOrCopy(const Cell& brick) {
  if (GrowingBrick* found = copies_.find(brick)) return *found;
  static const PackedVoxels kUnknown;
  const PackedVoxels* voxels = voxels_.find(brick);
  return copy(brick, voxels == nullptr ? &kUnknown : voxels);
}

GrowingBrick& GrowingBricks::copy(const Cell& brick, const PackedVoxels* voxels) {
  GrowingBrick& copy = copies_.findOrAdd(brick);
  copy.voxels = voxels;
  voxels->forEachValue([&](float log_odds, const BrickMask& of_value) {
    const bool is_occupied = classify(log_odds) == Occupancy::kOccupied;
    const bool is_stable =
        is_occupied ? log_odds >= thresholds_.alpha_max : log_odds <= thresholds_.alpha_min;
    if (is_stable) copy.stable[is_occupied ? 1 : 0] |= of_value;
  });
  if (const GrownBrick* grown = grown_.find(brick)) {
    static_cast<GrownBrick&>(copy) = *grown;
    for (const HeldVoxel& held : copy.held) copy.held_voxels.set(held.voxel);
  }
  return copy;
}

bool GrowingBricks::isAllFusible(const CellBox& box, Occupancy occupancy) {
  return !anyBrick(box, [&](const Cell& brick) {
    const GrowingBrick& copy = at(brick);
    const BrickMask part = BrickMask::ofBox(intersect(box, brickBox(brick)));
    return !copy.stableOf(occupancy).contains(part) || copy.held_voxels.intersects(part);
  });
}

Cuboid GrowingBricks::cuboidAt(const Cell& cell) {
  const GrowingBrick& brick = at(brickOf(cell));
  if (!brick.fused.test(voxelIndex(cell))) {
    return {CellBox::ofCell(cell), brick.voxels->at(voxelIndex(cell))};
  }
  return *std::find_if(brick.cuboids.begin(), brick.cuboids.end(),
                       [&cell](const Cuboid& cuboid) { return cuboid.box.contains(cell); });
}

void GrowingBricks::add(const Cuboid& cuboid) {
  forEachBrick(cuboid.box, [&](const Cell& brick) {
    GrowingBrick& copy = at(brick);
    copy.cuboids.push_back(cuboid);
    copy.fused |= BrickMask::ofBox(intersect(cuboid.box, brickBox(brick)));
    copy.has_other_cuboids = true;
  });
}

void GrowingBricks::remove(const CellBox& box) {
  forEachBrick(box, [&](const Cell& brick) {
    GrowingBrick& copy = at(brick);
    const auto found = std::find_if(copy.cuboids.begin(), copy.cuboids.end(),
                                    [&box](const Cuboid& cuboid) { return cuboid.box == box; });
    *found = copy.cuboids.back();
    copy.cuboids.pop_back();
    copy.fused &= ~BrickMask::ofBox(intersect(box, brickBox(brick)));
    copy.has_other_cuboids = true;
  });
}

}  // namespace cuboid_mapping
