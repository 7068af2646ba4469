// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/frontier_query.h"

#include "cuboid_mapping/geometry/box_faces.h"
#include "cuboid_mapping/query/fit_query.h"
#include "cuboid_mapping/query/ray_query.h"
#include "cuboid_mapping/voxels/brick_table.h"

#include <algorithm>

namespace cuboid_mapping {
namespace {

struct FrontierBrick {
  Cell brick;
  BrickMask voxels;
};
using FrontierTable = BrickTable<FrontierBrick>;

/// The voxels of a brick whose neighbour in a direction is unknown.
BrickMask besideUnknown(const VoxelStore& voxels, const VoxelBrick& brick, int axis, int step) {
  Cell beside = brick.brick;
  beside[axis] += step * kBrickEdge;
  const PackedVoxels* neighbor = voxels.find(beside);
  const BrickMask there = neighbor == nullptr ? BrickMask::all() : ~neighbor->known();
  return neighborsIn(~brick.voxels.known(), there, axis, step);
}

BrickMask frontierOf(const VoxelStore& voxels, const VoxelBrick& brick) {
  BrickMask beside;
  for (int axis = 0; axis < 3; ++axis) {
    for (const int step : {-1, 1}) beside |= besideUnknown(voxels, brick, axis, step);
  }
  return brick.voxels.free() & beside;
}

FrontierTable markFrontiers(const CuboidMap& map, const CellBox& region, Budget& budget) {
  FrontierTable table;
  map.voxels().visitIn(region, [&](const VoxelBrick& brick) {
    if (!budget.spend(7)) return Visit::kStop;
    const BrickMask part = BrickMask::ofBox(intersect(region, brickBox(brick.brick)));
    const BrickMask frontier = frontierOf(map.voxels(), brick) & part;
    if (!frontier.isEmpty()) table.findOrAdd(brick.brick).voxels = frontier;
    return Visit::kContinue;
  });
  return table;
}

/// Moves the voxels in a box from the table to a cluster.
void take(FrontierTable& table, const CellBox& box, std::vector<Cell>& cluster) {
  forEachBrick(box, [&](const Cell& at) {
    FrontierBrick* brick = table.find(at);
    if (brick == nullptr) return;
    const BrickMask found = brick->voxels & BrickMask::ofBox(intersect(box, brickBox(at)));
    forEachCell(at, found, [&](const Cell& cell) { cluster.push_back(cell); });
    brick->voxels = brick->voxels.without(found);
  });
}

/// Removes a voxel and all that are connected to it. @return These; none if the budget is spent.
std::vector<Cell> takeCluster(FrontierTable& table, const Cell& first, Budget& budget) {
  std::vector<Cell> cluster;
  take(table, CellBox::ofCell(first), cluster);
  for (std::size_t i = 0; i < cluster.size(); ++i) {
    if (!budget.spendAndUnlock()) return {};
    take(table, dilate(CellBox::ofCell(cluster[i])), cluster);
  }
  std::sort(cluster.begin(), cluster.end());
  return cluster;
}

/// The clusters, the largest first; some of them if the budget is spent. Others get their turn meanwhile.
std::vector<Frontier> takeClusters(FrontierTable table, std::size_t min_voxels, Budget& budget) {
  std::vector<FrontierBrick> bricks;
  table.forEach([&](const FrontierBrick& brick) { bricks.push_back(brick); });
  std::vector<Frontier> frontiers;
  for (const FrontierBrick& brick : bricks) {
    forEachCell(brick.brick, brick.voxels, [&](const Cell& cell) {
      std::vector<Cell> cluster = takeCluster(table, cell, budget);
      if (cluster.empty() || cluster.size() < min_voxels) return;
      frontiers.emplace_back().voxels = std::move(cluster);
    });
  }
  std::sort(frontiers.begin(), frontiers.end(), [](const Frontier& a, const Frontier& b) {
    if (a.voxels.size() != b.voxels.size()) return a.voxels.size() > b.voxels.size();
    return a.voxels.front() < b.voxels.front();
  });
  return frontiers;
}

/// The centre of the voxel nearest to the mean.
Eigen::Vector3d findCenter(const Grid& grid, const std::vector<Cell>& voxels) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Cell& cell : voxels) mean += toVector(cell);
  mean /= static_cast<double>(voxels.size());
  const auto nearest =
      std::min_element(voxels.begin(), voxels.end(), [&](const Cell& a, const Cell& b) {
        return (toVector(a) - mean).squaredNorm() < (toVector(b) - mean).squaredNorm();
      });
  return grid.centerOf(CellBox::ofCell(*nearest));
}

bool isSeen(const CuboidMap& map, const Eigen::Vector3d& from_map, const Cell& cell, double range_m,
            Budget& budget) {
  const Eigen::Vector3d to_cell = map.grid().centerOf(CellBox::ofCell(cell)) - from_map;
  const double distance_m = to_cell.norm();
  if (distance_m > range_m) return false;
  if (distance_m == 0.0) return true;
  return findFirstHit(map, from_map, to_cell, distance_m, budget).isNotFound();
}

double seeUnknown(const CuboidMap& map, const Eigen::Vector3d& from_map, double range_m,
                  Budget& budget) {
  const Eigen::Vector3d range = Eigen::Vector3d::Constant(range_m);
  const auto box = map.grid().toCellBox({from_map - range, from_map + range});
  if (range_m == 0.0 || !box) return 0.0;
  double num_seen = 0.0;
  forEachBrick(*box, [&](const Cell& brick) {
    if (!budget.spendAndUnlock()) return;
    const PackedVoxels* voxels = map.voxels().find(brick);
    BrickMask unknown = BrickMask::ofBox(intersect(*box, brickBox(brick)));
    if (voxels != nullptr) unknown = unknown.without(voxels->known());
    forEachCell(brick, unknown, [&](const Cell& cell) {
      if (isSeen(map, from_map, cell, range_m, budget)) num_seen += 1.0;
    });
  });
  return num_seen * map.grid().voxelVolume();
}

bool isValid(const FrontierTask& task, const Grid& grid) {
  const Eigen::Vector3d reach_m = task.size_m.array() + 2.0 * task.max_distance_m;
  return !task.region.isEmpty() && task.size_m.minCoeff() > 0.0 && task.max_distance_m >= 0.0 &&
         grid.toSizeInCells(reach_m) && task.view_range_m >= 0.0 &&
         task.view_range_m <= FrontierTask::kMaxViewRange * grid.resolution();
}

}  // namespace

Answer<std::vector<Frontier>> findFrontiers(const CuboidMap& map, const FrontierTask& task,
                                            Budget& budget) {
  if (!isValid(task, map.grid())) {
    return Answer<std::vector<Frontier>>::invalid(
        "the region must not be empty, size must be three edges > 0, and max_distance and "
        "view_range >= 0 within the range of the grid, all finite, and view_range at most 500 "
        "voxels");
  }
  FrontierTable marked = markFrontiers(map, task.region, budget);
  std::vector<Frontier> frontiers;
  if (!budget.isSpent()) {
    frontiers = takeClusters(std::move(marked), task.min_voxels, budget);
  }
  const auto num_skipped = static_cast<std::ptrdiff_t>(std::min(task.first, frontiers.size()));
  frontiers.erase(frontiers.begin(), frontiers.begin() + num_skipped);
  std::size_t num_complete = 0;
  for (Frontier& frontier : frontiers) {
    if (!budget.addEntries()) break;
    frontier.center_map = findCenter(map.grid(), frontier.voxels);
    const auto place = findNearestFit(map, frontier.center_map, task.size_m,
                                      UnknownPolicy::kObstacle, task.max_distance_m, budget);
    if (place.isFound()) {
      frontier.place_map = place->center_map;
      frontier.unknown_volume_m3 = seeUnknown(map, *frontier.place_map, task.view_range_m, budget);
    }
    if (budget.isSpent()) break;
    ++num_complete;
  }
  frontiers.resize(num_complete);
  return answerWithAll(std::move(frontiers), !budget.isSpent());
}

}  // namespace cuboid_mapping
