// SPDX-License-Identifier: BSD-3-Clause
#include "paper_grid.h"

namespace cuboid_mapping::bench {

void PaperGrid::update(const ScanUpdate& update) {
  for (const BrickUpdate& brick : update.bricks) {
    forEachCell(brick.brick, brick.hits, [&](const Cell& voxel) { observe(voxel, model_.hit()); });
    forEachCell(brick.brick, brick.misses & ~brick.hits,
                [&](const Cell& voxel) { observe(voxel, model_.miss()); });
  }
}

void PaperGrid::observe(const Cell& voxel, float observation) {
  const auto cell = find(voxel);
  if (!cell) {
    const float log_odds = model_.update(0.0F, observation);
    log_odds_.emplace(voxel, log_odds);
    tree_.insert({CellBox::ofCell(voxel), classify(log_odds)});
    return;
  }
  // A fused cell is stable, and so is not updated.
  float& log_odds = log_odds_.at(cell->box.min);
  log_odds = model_.update(log_odds, observation);
  if (classify(log_odds) == cell->occupancy) return;
  (void)tree_.replace(cell->box, {cell->box, classify(log_odds)});
}

std::optional<Cuboid> PaperGrid::find(const Cell& voxel) const {
  std::optional<Cuboid> found;
  visitCell(tree_, voxel, [&found](const Cuboid& cell) {
    found = cell;
    return Visit::kStop;
  });
  return found;
}

bool PaperGrid::isStable(const Cuboid& cell) const {
  return model_.isStable(log_odds_.at(cell.box.min));
}

/// Fuse(g_i) of Figure 5 for each cell of T, its recursion as a loop.
void PaperGrid::fuse(const std::vector<Cell>& starters) {
  for (const Cell& starter : starters) {
    const auto start = find(starter);
    if (!start || !isStable(*start)) continue;
    Cuboid cell = *start;
    while (expand(cell)) {
    }
  }
}

/// Lines 1 to 11. @return Whether the cell has expanded in one of the directions.
bool PaperGrid::expand(Cuboid& cell) {
  const Cell width = cell.box.size();
  const Cell order = reading_.grows_along ? width : Cell{} - width;
  for (const SearchDirection direction : paperDirections(order)) {
    const std::int32_t depth = reading_.step == GrowthStep::kCell ? 1 : width[direction.axis];
    if (absorb(slabOf(cell.box, direction, depth), cell)) return true;
  }
  return false;
}

/// Lines 9 to 12: conditions (6) to (8); then g_i and all g_k are removed, the fused cell inserted.
bool PaperGrid::absorb(const CellBox& slab, Cuboid& cell) {
  std::vector<CellBox> boxes{cell.box};
  double num_voxels = 0.0;
  bool can_fuse = true;
  visitBox(tree_, slab, CuboidFilter::kAll, [&](const Cuboid& other) {
    can_fuse = slab.contains(other.box) && other.occupancy == cell.occupancy && isStable(other);
    boxes.push_back(other.box);
    num_voxels += other.box.numVoxels();
    return can_fuse ? Visit::kContinue : Visit::kStop;
  });
  if (!can_fuse || boxes.size() == 1) return false;
  if (reading_.is_gap_free && num_voxels != slab.numVoxels()) return false;
  // All of them have the probability of the threshold, so the average has it, too.
  const float log_odds = log_odds_.at(cell.box.min);
  for (const CellBox& box : boxes) {
    log_odds_.erase(box.min);
    tree_.remove(box);
  }
  cell.box = unite(cell.box, slab);
  log_odds_.emplace(cell.box.min, log_odds);
  tree_.insert(cell);
  return true;
}

double PaperGrid::numVoxels() const {
  double sum = 0.0;
  visitAll(tree_, CuboidFilter::kAll, [&sum](const Cuboid& cell) {
    sum += cell.box.numVoxels();
    return Visit::kContinue;
  });
  return sum;
}

std::vector<Cell> startersOf(const ScanUpdate& update) {
  std::vector<Cell> starters;
  for (const BrickUpdate& brick : update.bricks) {
    forEachCell(brick.brick, brick.hits, [&](const Cell& voxel) { starters.push_back(voxel); });
  }
  starters.insert(starters.end(), update.samples.begin(), update.samples.end());
  return starters;
}

}  // namespace cuboid_mapping::bench
