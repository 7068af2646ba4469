// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/frontier_query.h"

#include "cuboid_mapping/query/fit_query.h"
#include "cuboid_mapping/query/ray_query.h"
#include "cuboid_mapping/voxels/brick_table.h"

#include <algorithm>
#include <cmath>

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
  map.voxels().forEachIn(region, [&](const VoxelBrick& brick) {
    if (!budget.spend(7)) return;
    const BrickMask part = BrickMask::ofBox(intersect(region, brickBox(brick.brick)));
    const BrickMask frontier = frontierOf(map.voxels(), brick) & part;
    if (!frontier.isEmpty()) table.findOrAdd(brick.brick).voxels = frontier;
  });
  return table;
}

/// Removes a voxel. @return Whether it was there.
bool take(FrontierTable& table, const Cell& cell) {
  FrontierBrick* brick = table.find(brickOf(cell));
  if (brick == nullptr || !brick->voxels.test(voxelIndex(cell))) return false;
  brick->voxels = brick->voxels.without(BrickMask::ofBox(CellBox::ofCell(cell)));
  return true;
}

/// Removes a voxel and all that are connected to it. @return These.
std::vector<Cell> takeCluster(FrontierTable& table, const Cell& first) {
  std::vector<Cell> cluster;
  if (take(table, first)) cluster.push_back(first);
  for (std::size_t i = 0; i < cluster.size(); ++i) {
    const Cell cell = cluster[i];
    for (std::int32_t z = cell.z - 1; z <= cell.z + 1; ++z) {
      for (std::int32_t y = cell.y - 1; y <= cell.y + 1; ++y) {
        for (std::int32_t x = cell.x - 1; x <= cell.x + 1; ++x) {
          if (take(table, {x, y, z})) cluster.push_back({x, y, z});
        }
      }
    }
  }
  std::sort(cluster.begin(), cluster.end());
  return cluster;
}

std::vector<Frontier> takeClusters(FrontierTable table, std::size_t min_voxels) {
  std::vector<FrontierBrick> bricks;
  table.forEach([&](const FrontierBrick& brick) { bricks.push_back(brick); });
  std::vector<Frontier> frontiers;
  for (const FrontierBrick& brick : bricks) {
    forEachCell(brick.brick, brick.voxels, [&](const Cell& cell) {
      std::vector<Cell> cluster = takeCluster(table, cell);
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
  if (!budget.isSpent()) frontiers = takeClusters(std::move(marked), task.min_voxels);
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
