// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/grower.h"

#include "cuboid_mapping/fusion/search_directions.h"

#include <algorithm>
#include <random>
#include <utility>

namespace cuboid_mapping {

/// A growing cell. The bricks change only when it stops: until then the absorbed cuboids lie inside its box, which it
/// does not search again.
struct Grower::Growth {
  CellBox box;
  Occupancy occupancy;
  std::vector<CellBox> absorbed;  ///< Fused cuboids inside the box.
};

void Grower::grow(std::vector<Cell> cells) {
  while (!cells.empty()) {
    for (const Cell& cell : cells) tryCell(cell);
    cells = startersBesideFused();
    for (const Cell& cell : tried_) bricks_.at(brickOf(cell)).tried = {};
    tried_.clear();
    fused_.clear();
  }
}

/// Fuse(g_i) of Figure 5 for the cuboid that holds a cell, as a loop in place of a recursion.
void Grower::tryCell(const Cell& cell) {
  const GrowingBrick& brick = bricks_.at(brickOf(cell));
  const int voxel = voxelIndex(cell);
  const bool is_stable = brick.stable[0].test(voxel) || brick.stable[1].test(voxel);
  if (!is_stable || brick.held_voxels.test(voxel)) return;
  const bool is_fused = brick.fused.test(voxel);
  const Cuboid start = bricks_.cuboidAt(cell);
  GrowingBrick& first = bricks_.at(brickOf(start.box.min));
  first.starters.set(voxelIndex(start.box.min));
  if (first.tried.test(voxelIndex(start.box.min))) return;
  Growth growth{start.box, start.occupancy, {}};
  while (expand(growth)) {
  }
  const Cell& least = growth.box.min;
  GrowingBrick& last = bricks_.at(brickOf(least));
  last.starters.set(voxelIndex(least));
  last.tried.set(voxelIndex(least));
  tried_.push_back(least);
  if (growth.box == start.box) return;
  if (is_fused) bricks_.remove(start.box);
  for (const CellBox& box : growth.absorbed) bricks_.remove(box);
  bricks_.add({growth.box, growth.occupancy});
  fused_.push_back(growth.box);
}

/// One expansion (equation 5). @return Whether it succeeded.
bool Grower::expand(Growth& growth) {
  if (config_.search.order == SearchStrategy::Order::kLargestGain) return expandMost(growth);
  for (const SearchDirection direction : directionsOf(growth.box)) {
    if (absorb(direction, growth)) return true;
  }
  return false;
}

bool Grower::expandMost(Growth& growth) {
  std::optional<Growth> best;
  std::size_t most = 0;
  for (const SearchDirection direction : paperDirections(growth.box.size())) {
    Growth next{growth.box, growth.occupancy, {}};
    if (!absorb(direction, next)) continue;
    double num_absorbed = next.box.numVoxels() - growth.box.numVoxels();
    for (const CellBox& box : next.absorbed) num_absorbed -= box.numVoxels() - 1.0;
    if (best && static_cast<std::size_t>(num_absorbed) <= most) continue;
    most = static_cast<std::size_t>(num_absorbed);
    best = std::move(next);
  }
  if (!best) return false;
  growth.box = best->box;
  growth.absorbed.insert(growth.absorbed.end(), best->absorbed.begin(), best->absorbed.end());
  return true;
}

/// Slab by which a cell expands; nothing when it cannot.
std::optional<CellBox> Grower::findSlab(SearchDirection direction, const Growth& growth) {
  const int axis = direction.axis;
  const CellBox next = slabOf(growth.box, direction, 1);
  if (!bricks_.isAllFusible(next, growth.occupancy)) return std::nullopt;
  if (config_.step == GrowthStep::kCell) return next;
  std::int32_t depth = growth.box.max[axis] - growth.box.min[axis];
  if (config_.step == GrowthStep::kNeighbour) {
    const CellBox neighbour = bricks_.cuboidAt(next.min).box;
    depth = direction.sign > 0 ? neighbour.max[axis] - growth.box.max[axis]
                               : growth.box.min[axis] - neighbour.min[axis];
  }
  const CellBox slab = slabOf(growth.box, direction, depth);
  if (!bricks_.isAllFusible(slab, growth.occupancy)) return std::nullopt;
  return slab;
}

/// Absorbs the cells of a slab if the conditions (6) to (8) hold; changes nothing otherwise.
bool Grower::absorb(SearchDirection direction, Growth& growth) {
  const auto slab = findSlab(direction, growth);
  if (!slab) return false;
  const std::size_t num_before = growth.absorbed.size();
  bool is_tiled = true;
  bricks_.visitFused(*slab, [&](const Cuboid& cuboid) {
    is_tiled = slab->contains(cuboid.box);
    if (is_tiled) growth.absorbed.push_back(cuboid.box);
    return is_tiled ? Visit::kContinue : Visit::kStop;
  });
  if (!is_tiled) {
    growth.absorbed.resize(num_before);
    return false;
  }
  growth.box = unite(growth.box, *slab);
  return true;
}

SearchDirections Grower::directionsOf(const CellBox& box) const {
  switch (config_.search.order) {
    case SearchStrategy::Order::kFixed: return config_.search.directions;
    case SearchStrategy::Order::kRandom: {
      SearchDirections directions = paperDirections({1, 1, 1});
      std::mt19937_64 random(static_cast<std::uint64_t>(config_.sampling.seed) +
                             CellHash()(box.min) + 3 * CellHash()(box.max));
      for (std::size_t left = directions.size(); left > 1; --left) {
        std::swap(directions[left - 1], directions[random() % left]);
      }
      return directions;
    }
    default: return paperDirections(box.size());
  }
}

/// Starters that may be able to grow now, because a cell beside them has fused.
std::vector<Cell> Grower::startersBesideFused() {
  std::vector<Cell> cells;
  if (fused_.empty()) return cells;
  if (config_.step != GrowthStep::kCell) {  // Larger steps reach beyond the next voxel.
    bricks_.forEach([&](const GrowingBrick& brick) {
      forEachCell(brick.brick, brick.starters, [&](const Cell& cell) { cells.push_back(cell); });
    });
    fused_.clear();
  }
  for (const CellBox& box : fused_) {
    const CellBox around = dilate(box);
    forEachBrick(around, [&](const Cell& brick) {
      const GrowingBrick& copy = bricks_.at(brick);
      const BrickMask part = BrickMask::ofBox(intersect(around, brickBox(brick)));
      forEachCell(brick, copy.starters.without(copy.fused) & part,
                  [&](const Cell& cell) { cells.push_back(cell); });
    });
    bricks_.visitFused(around, [&](const Cuboid& cuboid) {
      const Cell& least = cuboid.box.min;
      if (bricks_.at(brickOf(least)).starters.test(voxelIndex(least))) cells.push_back(least);
      return Visit::kContinue;
    });
  }
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  return cells;
}

}  // namespace cuboid_mapping
