// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/growth_fusion.h"

#include "cuboid_mapping/fusion/search_directions.h"
#include "cuboid_mapping/rtree/traversal.h"

#include <algorithm>
#include <cassert>
#include <new>
#include <optional>
#include <random>
#include <utility>

namespace cuboid_mapping {
namespace {

std::optional<Cuboid> findCuboid(const RTree& tree, const Cell& cell) {
  std::optional<Cuboid> found;
  visitBox(tree, CellBox::ofCell(cell), CuboidFilter::kAll, [&](const Cuboid& cuboid) {
    found = cuboid;
    return Visit::kStop;
  });
  return found;
}

/// The box with one more cell around it on all sides.
CellBox dilate(const CellBox& box) { return {box.min - Cell{1, 1, 1}, box.max + Cell{1, 1, 1}}; }

}  // namespace

const char* toString(GrowthStarters starters) {
  switch (starters) {
    case GrowthStarters::kSampled: return "sampled";
    case GrowthStarters::kEndPoints: return "end_points";
    case GrowthStarters::kChanged: break;
  }
  return "changed";
}

/// A growing cell. The tree changes only when it stops: until then the absorbed cuboids lie inside its box,
/// which it does not search again.
struct GrowthFusion::Growth {
  CellBox box;
  Occupancy occupancy;
  std::vector<CellBox> parts;  ///< The cell at first, then the absorbed cuboids.
};

void GrowthFusion::visitBox(const VoxelStore& /*voxels*/, const CellBox& window,
                            CuboidFilter filter, CuboidVisitor visit) const {
  cuboid_mapping::visitBox(tree_, window, filter, visit);
}

void GrowthFusion::visitNearest(const VoxelStore& /*voxels*/, const Eigen::Vector3d& point,
                                double max_distance, CuboidFilter filter,
                                DistanceVisitor visit) const {
  cuboid_mapping::visitNearest(tree_, point, max_distance, filter, visit);
}

void GrowthFusion::grow(const VoxelStore& voxels, const ScanUpdate& update,
                        const CellWrites& writes, ChangeSet& changes) noexcept {
  ++num_clouds_;
  try {
    settleAndGrow(voxels, update, writes, changes);
  } catch (const std::bad_alloc&) {
    settling_.clear();
    changes.is_everything = true;
  }
  tree_.trim();
}

void GrowthFusion::settleAndGrow(const VoxelStore& voxels, const ScanUpdate& update,
                                 const CellWrites& writes, ChangeSet& changes) {
  std::vector<Cell> observed;  // The paper's set T.
  for (const CellWrites::BrickWrite& write : writes.bricks) {
    settling_.noteChanges(write.brick, write.changed, num_clouds_);
    settling_.hold(write.brick, write.split, num_clouds_);
    if (config_.starters != GrowthStarters::kChanged) continue;
    forEachCell(write.brick, write.changed, [&](const Cell& cell) { observed.push_back(cell); });
  }
  if (config_.starters != GrowthStarters::kChanged) {
    for (const BrickUpdate& brick : update.bricks) {
      forEachCell(brick.brick, brick.hits, [&](const Cell& cell) { observed.push_back(cell); });
    }
    observed.insert(observed.end(), update.samples.begin(), update.samples.end());
  }
  std::vector<CellBox> fused;
  grow(voxels, observed, fused);
  for (const CellBox& box : fused) changes.addCuboidsIn(box);
}

bool GrowthFusion::isFusible(const Cell& cell) const {
  const FusibleBrick* found = fusible_.find(brickOf(cell));
  return found != nullptr && found->fusible.test(voxelIndex(cell));
}

bool GrowthFusion::isAllFusible(const VoxelStore& voxels, const CellBox& box,
                                Occupancy occupancy) const {
  const bool is_occupied = occupancy == Occupancy::kOccupied;
  return !anyBrick(box, [&](const Cell& brick) {
    const FusibleBrick* found = fusible_.find(brick);
    if (found == nullptr) return true;
    const PackedVoxels& of_brick = *voxels.find(brick);
    const BrickMask part = BrickMask::ofBox(intersect(box, brickBox(brick)));
    return !found->fusible.contains(part) ||
           !(is_occupied ? of_brick.occupied() : of_brick.free()).contains(part);
  });
}

/// Grows the starters until none of them can: one pass tries each starter once; the next pass
/// tries those beside a fused cuboid again.
/// @param fused  Gets the fused cuboids, also those absorbed on the way.
void GrowthFusion::grow(const VoxelStore& voxels, const std::vector<Cell>& observed,
                        std::vector<CellBox>& fused) {
  starters_.clear();
  std::vector<Cell> cells = releaseSettled(voxels);
  cells.insert(cells.end(), observed.begin(), observed.end());
  while (!cells.empty()) {
    const std::size_t num_before = fused.size();
    tried_.clear();
    for (const Cell& cell : cells) tryCell(voxels, cell, fused);
    cells = findStartersBeside(fused, num_before);
  }
}

/// Makes settled cells fusible. @return These cells, and the cuboids around them, which could not
/// grow before.
std::vector<Cell> GrowthFusion::releaseSettled(const VoxelStore& voxels) {
  std::vector<Cell> cells;
  for (const Cell& cell : settling_.release(num_clouds_)) {
    const PackedVoxels* voxels_now = voxels.find(brickOf(cell));
    if (voxels_now == nullptr) continue;
    const std::optional<float> log_odds = voxels_now->logOddsAt(voxelIndex(cell));
    if (!log_odds || !model_.isStable(*log_odds)) continue;
    fusible_.findOrAdd(brickOf(cell)).fusible.set(voxelIndex(cell));
    const CellBox around = dilate(CellBox::ofCell(cell));
    cuboid_mapping::visitBox(tree_, around, CuboidFilter::kAll, [&](const Cuboid& cuboid) {
      cells.push_back(cuboid.box.min);
      return Visit::kContinue;
    });
  }
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  return cells;
}

/// Fuse(g_i) of Figure 5 for the cuboid that holds a cell, as a loop in place of a recursion.
void GrowthFusion::tryCell(const VoxelStore& voxels, const Cell& cell,
                           std::vector<CellBox>& fused) {
  if (!isFusible(cell)) return;
  const auto start = findCuboid(tree_, cell);
  assert(start);
  starters_.insert(start->box.min);
  if (tried_.count(start->box.min) != 0) return;
  Growth growth{start->box, start->occupancy, {start->box}};
  while (expand(voxels, growth)) {
  }
  starters_.insert(growth.box.min);
  tried_.insert(growth.box.min);
  if (growth.parts.size() == 1) return;
  fused.push_back(growth.box);
  tree_.reserve(0, growth.parts.size() - 1);  // Nothing fails from here on.
  for (std::size_t i = 1; i < growth.parts.size(); ++i) (void)tree_.removeReserved(growth.parts[i]);
  (void)tree_.replace(growth.parts.front(), {growth.box, growth.occupancy});
}

/// One expansion (equation 5). @return Whether it succeeded.
bool GrowthFusion::expand(const VoxelStore& voxels, Growth& growth) const {
  if (config_.search.order == SearchStrategy::Order::kLargestGain) {
    return expandMost(voxels, growth);
  }
  for (const SearchDirection direction : directionsOf(growth.box)) {
    if (absorb(voxels, direction, growth)) return true;
  }
  return false;
}

bool GrowthFusion::expandMost(const VoxelStore& voxels, Growth& growth) const {
  std::optional<Growth> best;
  for (const SearchDirection direction : paperDirections(growth.box.size())) {
    Growth part{growth.box, growth.occupancy, {}};
    if (!absorb(voxels, direction, part)) continue;
    if (!best || part.parts.size() > best->parts.size()) best = std::move(part);
  }
  if (!best) return false;
  growth.box = best->box;
  growth.parts.insert(growth.parts.end(), best->parts.begin(), best->parts.end());
  return true;
}

/// Slab by which a cell expands; nothing when it cannot.
std::optional<CellBox> GrowthFusion::findSlab(const VoxelStore& voxels, SearchDirection direction,
                                              const Growth& growth) const {
  const int axis = direction.axis;
  const CellBox next = slabOf(growth.box, direction, 1);
  if (!isAllFusible(voxels, next, growth.occupancy)) return std::nullopt;
  if (config_.step == GrowthStep::kCell) return next;
  std::int32_t depth = growth.box.max[axis] - growth.box.min[axis];
  if (config_.step == GrowthStep::kNeighbour) {
    const CellBox neighbour = findCuboid(tree_, next.min)->box;
    depth = direction.sign > 0 ? neighbour.max[axis] - growth.box.max[axis]
                               : growth.box.min[axis] - neighbour.min[axis];
  }
  const CellBox slab = slabOf(growth.box, direction, depth);
  if (!isAllFusible(voxels, slab, growth.occupancy)) return std::nullopt;
  return slab;
}

/// Absorbs the cells of a slab if the conditions (6) to (8) hold; changes nothing otherwise.
bool GrowthFusion::absorb(const VoxelStore& voxels, SearchDirection direction,
                          Growth& growth) const {
  const auto found_slab = findSlab(voxels, direction, growth);
  if (!found_slab) return false;
  const CellBox& slab = *found_slab;
  const std::size_t num_before = growth.parts.size();
  bool is_tiled = true;
  cuboid_mapping::visitBox(tree_, slab, CuboidFilter::kAll, [&](const Cuboid& cuboid) {
    is_tiled = slab.contains(cuboid.box);
    if (!is_tiled) return Visit::kStop;
    growth.parts.push_back(cuboid.box);
    return Visit::kContinue;
  });
  if (!is_tiled) {
    growth.parts.resize(num_before);
    return false;
  }
  growth.box = unite(growth.box, slab);
  return true;
}

SearchDirections GrowthFusion::directionsOf(const CellBox& box) const {
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
/// @param first  Index in `fused` to start from.
std::vector<Cell> GrowthFusion::findStartersBeside(const std::vector<CellBox>& fused,
                                                   std::size_t first) const {
  std::vector<Cell> cells;
  if (first == fused.size()) return cells;
  if (config_.step != GrowthStep::kCell) {  // Larger steps reach beyond the next voxel.
    cells.assign(starters_.begin(), starters_.end());
  }
  for (std::size_t i = first; i < fused.size() && config_.step == GrowthStep::kCell; ++i) {
    const CellBox around = dilate(fused[i]);
    cuboid_mapping::visitBox(tree_, around, CuboidFilter::kAll, [&](const Cuboid& cuboid) {
      if (starters_.count(cuboid.box.min) != 0) cells.push_back(cuboid.box.min);
      return Visit::kContinue;
    });
  }
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  return cells;
}

}  // namespace cuboid_mapping
