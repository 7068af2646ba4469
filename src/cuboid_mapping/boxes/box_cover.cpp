// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/boxes/box_cover.h"

#include "cuboid_mapping/boxes/box_merger.h"
#include "cuboid_mapping/boxes/cover_exchange.h"
#include "cuboid_mapping/boxes/joined_cuboids.h"

#include <algorithm>
#include <utility>

namespace cuboid_mapping {
namespace {

/// The boxes without the voxels of the holes.
std::vector<CellBox> subtractAll(std::vector<CellBox> boxes, const std::vector<CellBox>& holes) {
  for (const CellBox& hole : holes) {
    std::vector<CellBox> left;
    for (const CellBox& box : boxes) {
      for (const CellBox& piece : subtract(box, hole)) left.push_back(piece);
    }
    boxes.swap(left);
  }
  return boxes;
}

double sumOfVolumes(const std::vector<CellBox>& boxes) {
  double sum = 0.0;
  for (const CellBox& box : boxes) sum += box.numVoxels();
  return sum;
}

bool isLarger(const CellBox& a, const CellBox& b) {
  if (a.numVoxels() != b.numVoxels()) return a.numVoxels() > b.numVoxels();
  return a.min != b.min ? a.min < b.min : a.max < b.max;
}

}  // namespace

Answer<BoxCover> coverOccupied(const CuboidMap& map, const CoverTask& task, Budget& budget) {
  if (task.max_boxes == 0 || task.region.isEmpty()) {
    return Answer<BoxCover>::invalid("max_boxes must be > 0, and the region not empty");
  }
  std::vector<CellBox> occupied;
  const auto joined = joinCuboids(map, task.region, CuboidFilter::kOccupied, budget);
  for (const Cuboid& cuboid : joined.value) occupied.push_back(cuboid.box);
  const double num_occupied = sumOfVolumes(occupied);
  occupied = subtractAll(std::move(occupied), task.keep_free);
  const double num_covered = sumOfVolumes(occupied);
  VoxelSet voxels(budget);
  for (const CellBox& box : occupied) voxels.add(box);

  BoxMerger merger(occupied, task.keep_free, budget);
  merger.mergeTo(task.max_boxes);
  CoverExchange exchange(voxels, merger.boxes(), task.keep_free, budget);
  if (merger.hasMerged()) exchange.improve(task.max_boxes);
  if (budget.isSpent() || !budget.addEntries(exchange.boxes().size())) {
    return AnswerStatus::kBudgetSpent;
  }
  BoxCover cover;
  cover.boxes = exchange.boxes();
  std::sort(cover.boxes.begin(), cover.boxes.end(), isLarger);
  const double voxel_volume_m3 = map.grid().voxelVolume();
  cover.occupied_volume_m3 = num_covered * voxel_volume_m3;
  cover.added_volume_m3 = exchange.numAdded() * voxel_volume_m3;
  cover.left_out_volume_m3 = (num_occupied - num_covered) * voxel_volume_m3;
  if (cover.boxes.size() > task.max_boxes) return {AnswerStatus::kNotFound, std::move(cover)};
  return cover;
}

}  // namespace cuboid_mapping
