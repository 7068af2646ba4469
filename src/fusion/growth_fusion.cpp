// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/growth_fusion.h"

#include "cuboid_mapping/rtree/traversal.h"

#include <algorithm>
#include <cassert>
#include <optional>
#include <random>
#include <utility>

namespace cuboid_mapping {
namespace {

struct PlacedCuboid {
  Cuboid cuboid;
  LeafSlot place;
};

std::optional<PlacedCuboid> findCuboid(const RTree& tree, const Cell& cell) {
  std::optional<PlacedCuboid> found;
  visitLeafSlots(tree, CellBox::ofCell(cell), CuboidFilter::kAll, [&](NodeIndex leaf, int slot) {
    found = PlacedCuboid{tree.node(0, leaf).cuboid(slot), {leaf, slot}};
    return Visit::kStop;
  });
  return found;
}

float meanLogOdds(const std::vector<Cuboid>& cuboids) {
  MeanLogOdds mean;
  for (const Cuboid& cuboid : cuboids) mean.add(cuboid.log_odds, cuboid.box.numVoxels());
  return mean.value();
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

/// A cell that grows. The tree changes when it has stopped only: what it has absorbed lies inside
/// its box, where it does not look any more.
struct GrowthFusion::Growth {
  CellBox box;
  Occupancy occupancy;
  std::vector<Cuboid> cuboids;   ///< That it consists of, itself first.
  std::vector<LeafSlot> places;  ///< Of these.
};

GrowthFusion::GrowthFusion(const GrowthConfig& config, const SensorModel& sensor_model)
    : config_(config), sensor_model_(sensor_model), settling_(config.settle_clouds) {}

void GrowthFusion::clear() {
  fusible_.clear();
  settling_.clear();
  changed_.clear();
}

void GrowthFusion::note(const DenseBrick& brick, const BrickChange& change, std::uint64_t cloud) {
  settling_.noteChanges(brick.brick, change.changed, cloud);
  settling_.hold(brick.brick, change.split, cloud);
  if (config_.starters == GrowthStarters::kChanged) {
    forEachCell(brick.brick, change.changed, [&](const Cell& cell) { changed_.push_back(cell); });
  }
  const BrickMask held = settling_.heldIn(brick.brick);
  BrickMask fusible{};
  BrickMask occupied{};
  forEachCell(brick.brick, brick.known, [&](const Cell& cell) {
    const float log_odds = brick.log_odds[static_cast<std::size_t>(voxelIndex(cell))];
    if (!sensor_model_.isStable(log_odds)) return;
    const auto z = static_cast<std::size_t>(cell.z & 7);
    fusible[z] |= voxelBit(cell) & ~held[z];
    if (classify(log_odds) == Occupancy::kOccupied) occupied[z] |= voxelBit(cell) & fusible[z];
  });
  fusible_.set(brick.brick, fusible, occupied);
}

void GrowthFusion::noteEdits(const std::vector<CellBox>& boxes, const RTree& tree) {
  for (const CellBox& box : boxes) {
    fusible_.fill(box, Occupancy::kUnknown);
    visitBox(tree, box, CuboidFilter::kAll, [&](const Cuboid& cuboid) {
      if (sensor_model_.isStable(cuboid.log_odds)) {
        fusible_.fill(intersect(box, cuboid.box), cuboid.occupancy());
      }
      return Visit::kContinue;
    });
  }
}

std::vector<Fused> GrowthFusion::fuse(const std::vector<Cell>& observed, std::uint64_t cloud,
                                      RTree& tree) {
  starters_.clear();
  std::vector<Cell> cells = releaseSettled(cloud, tree);
  const std::vector<Cell>& more =
      config_.starters == GrowthStarters::kChanged ? changed_ : observed;
  cells.insert(cells.end(), more.begin(), more.end());
  std::vector<Fused> fused;
  while (!cells.empty()) {
    const std::size_t num_before = fused.size();
    tried_.clear();
    for (const Cell& cell : cells) tryCell(cell, tree, fused);
    cells = findStartersBeside(fused, num_before, tree);
  }
  changed_.clear();
  return fused;
}

/// Makes the cells fusible that have settled. @return These, and the cuboids around them, which
/// could not grow as long as they were held.
std::vector<Cell> GrowthFusion::releaseSettled(std::uint64_t cloud, const RTree& tree) {
  std::vector<Cell> cells;
  for (const Cell& cell : settling_.release(cloud)) {
    const auto found = findCuboid(tree, cell);
    if (!found || !sensor_model_.isStable(found->cuboid.log_odds)) continue;
    VoxelClasses::Masks masks{};
    BrickMask fusible{};
    BrickMask occupied{};
    if (fusible_.find(brickOf(cell), masks)) {
      fusible = *masks.known;
      occupied = *masks.occupied;
    }
    const auto z = static_cast<std::size_t>(cell.z & 7);
    fusible[z] |= voxelBit(cell);
    if (found->cuboid.occupancy() == Occupancy::kOccupied) occupied[z] |= voxelBit(cell);
    fusible_.set(brickOf(cell), fusible, occupied);
    visitBox(tree, dilate(CellBox::ofCell(cell)), CuboidFilter::kAll, [&](const Cuboid& cuboid) {
      cells.push_back(cuboid.box.min);
      return Visit::kContinue;
    });
  }
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  return cells;
}

/// Fuse(g_i) of Figure 5 for the cuboid that holds a cell, as a loop in place of a recursion.
void GrowthFusion::tryCell(const Cell& cell, RTree& tree, std::vector<Fused>& fused) {
  const Occupancy occupancy = fusible_.at(cell);
  if (occupancy == Occupancy::kUnknown) return;
  const auto start = findCuboid(tree, cell);
  assert(start);
  const CellBox& box = start->cuboid.box;
  starters_.insert(box.min);
  if (tried_.count(box.min) != 0) return;
  Growth growth{box, occupancy, {start->cuboid}, {start->place}};
  while (expand(growth, tree)) {
  }
  starters_.insert(growth.box.min);
  tried_.insert(growth.box.min);
  if (growth.places.size() == 1) return;
  const Cuboid cuboid{growth.box, meanLogOdds(growth.cuboids)};
  tree.replace(growth.places, {cuboid});
  fused.push_back({cuboid, growth.places.size()});
}

/// One expansion (equation 5). @return Whether there was one that succeeds.
bool GrowthFusion::expand(Growth& growth, const RTree& tree) const {
  if (config_.search.order == SearchStrategy::Order::kLargestGain) return expandMost(growth, tree);
  for (const SearchDirection direction : directionsOf(growth.box)) {
    if (absorb(direction, growth, tree)) return true;
  }
  return false;
}

bool GrowthFusion::expandMost(Growth& growth, const RTree& tree) const {
  std::optional<Growth> best;
  for (const SearchDirection direction : paperDirections(growth.box.size())) {
    Growth part{growth.box, growth.occupancy, {}, {}};
    if (!absorb(direction, part, tree)) continue;
    if (!best || part.places.size() > best->places.size()) best = std::move(part);
  }
  if (!best) return false;
  growth.box = best->box;
  growth.cuboids.insert(growth.cuboids.end(), best->cuboids.begin(), best->cuboids.end());
  growth.places.insert(growth.places.end(), best->places.begin(), best->places.end());
  return true;
}

/// By how much a cell is to expand; nothing when it cannot.
std::optional<CellBox> GrowthFusion::findSlab(SearchDirection direction, const Growth& growth,
                                              const RTree& tree) const {
  const int axis = direction.axis;
  const CellBox next = slabOf(growth.box, direction, 1);
  if (!fusible_.isAll(next, growth.occupancy)) return std::nullopt;
  if (config_.step == GrowthStep::kCell) return next;
  std::int32_t depth = growth.box.max[axis] - growth.box.min[axis];
  if (config_.step == GrowthStep::kNeighbour) {
    const CellBox neighbour = findCuboid(tree, next.min)->cuboid.box;
    depth = direction.sign > 0 ? neighbour.max[axis] - growth.box.max[axis]
                               : growth.box.min[axis] - neighbour.min[axis];
  }
  const CellBox slab = slabOf(growth.box, direction, depth);
  if (!fusible_.isAll(slab, growth.occupancy)) return std::nullopt;
  return slab;
}

/// Absorbs the cells of a slab if the conditions (6) to (8) hold; changes nothing otherwise.
bool GrowthFusion::absorb(SearchDirection direction, Growth& growth, const RTree& tree) const {
  const auto found_slab = findSlab(direction, growth, tree);
  if (!found_slab) return false;
  const CellBox& slab = *found_slab;
  const std::size_t num_before = growth.places.size();
  bool is_tiled = true;
  visitLeafSlots(tree, slab, CuboidFilter::kAll, [&](NodeIndex leaf, int slot) {
    const Cuboid cuboid = tree.node(0, leaf).cuboid(slot);
    is_tiled = slab.contains(cuboid.box);
    if (!is_tiled) return Visit::kStop;
    growth.cuboids.push_back(cuboid);
    growth.places.push_back({leaf, slot});
    return Visit::kContinue;
  });
  if (!is_tiled) {
    growth.cuboids.resize(num_before);
    growth.places.resize(num_before);
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

/// Starters that may be able to grow now, because something beside them has fused.
/// @param first  Of `fused`, from which on to look.
std::vector<Cell> GrowthFusion::findStartersBeside(const std::vector<Fused>& fused,
                                                   std::size_t first, const RTree& tree) const {
  std::vector<Cell> cells;
  if (first == fused.size()) return cells;
  if (config_.step != GrowthStep::kCell) {  // They look further than the next voxel.
    cells.assign(starters_.begin(), starters_.end());
  }
  for (std::size_t i = first; i < fused.size() && config_.step == GrowthStep::kCell; ++i) {
    visitBox(tree, dilate(fused[i].cuboid.box), CuboidFilter::kAll, [&](const Cuboid& cuboid) {
      if (starters_.count(cuboid.box.min) != 0) cells.push_back(cuboid.box.min);
      return Visit::kContinue;
    });
  }
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  return cells;
}

}  // namespace cuboid_mapping
