// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/box_query.h"

#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/query/obstacles.h"

namespace cuboid_mapping {
namespace {

/// In larger boxes, the R-tree finds occupied cuboids faster than a look-up of every brick.
constexpr double kMaxVoxelsByBrick = 64.0 * kBrickVoxels;

}  // namespace

Occupancy BoxQueryResult::occupancy() const {
  if (occupied_volume_m3 > 0.0) return Occupancy::kOccupied;
  return unknown_volume_m3 > 0.0 ? Occupancy::kUnknown : Occupancy::kFree;
}

Answer<BoxQueryResult> queryCells(const CuboidMap& map, const CellBox& box, Budget& budget) {
  double free_voxels = 0.0;
  double occupied_voxels = 0.0;
  const Visit end = map.voxels().visitIn(box, [&](const VoxelBrick& brick) {
    if (!budget.spend()) return Visit::kStop;
    const BrickMask part = BrickMask::ofBox(intersect(box, brickBox(brick.brick)));
    free_voxels += (brick.voxels.free() & part).count();
    occupied_voxels += (brick.voxels.occupied() & part).count();
    return Visit::kContinue;
  });
  const double voxel_m3 = map.grid().voxelVolume();
  const double unknown_voxels = box.numVoxels() - free_voxels - occupied_voxels;
  const BoxQueryResult result{box, free_voxels * voxel_m3, occupied_voxels * voxel_m3,
                              unknown_voxels * voxel_m3};
  return {end == Visit::kStop ? AnswerStatus::kBudgetSpent : AnswerStatus::kFound, result};
}

Answer<BoxQueryResult> queryBox(const CuboidMap& map, const MetricBox& box_map, Budget& budget) {
  const auto box = map.grid().toCellBox(box_map);
  if (!box) {
    return Answer<BoxQueryResult>::invalid(
        "the box must be finite, with min < max, and within the range of the grid");
  }
  return queryCells(map, *box, budget);
}

bool isFree(const CuboidMap& map, const MetricBox& box_map, UnknownPolicy policy, Budget& budget) {
  const auto box = map.grid().toCellBox(box_map);
  return box && !Obstacles(map, policy, budget).isAny(*box) && !budget.isSpent();
}

bool isAnyOccupied(const CuboidMap& map, const CellBox& box) {
  if (box.numVoxels() <= kMaxVoxelsByBrick) {
    return Obstacles(map, UnknownPolicy::kFree, Budget::unlimited()).isAny(box);
  }
  bool found = false;
  visitBox(map, box, CuboidFilter::kOccupied, [&found](const Cuboid&) {
    found = true;
    return Visit::kStop;
  });
  return found;
}

}  // namespace cuboid_mapping
