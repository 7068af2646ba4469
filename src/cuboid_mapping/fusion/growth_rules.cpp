// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/growth_rules.h"

#include "cuboid_mapping/geometry/box_faces.h"

#include <utility>

namespace cuboid_mapping {

SearchDirections paperDirections(const Cell& width) {
  std::array<int, 3> axes{0, 1, 2};
  // By insertion: std::stable_sort would allocate memory.
  for (const std::size_t i : {1U, 2U, 1U}) {
    if (width[axes[i]] > width[axes[i - 1]]) std::swap(axes[i], axes[i - 1]);
  }
  return {{{axes[0], 1}, {axes[1], 1}, {axes[2], 1}, {axes[0], -1}, {axes[1], -1}, {axes[2], -1}}};
}

CellBox slabOf(const CellBox& box, SearchDirection direction, std::int32_t depth) {
  return slabBeyond(box, direction.axis + (direction.sign > 0 ? 3 : 0), depth);
}

bool absorbSlab(const CellBox& slab, GrowingBricks& bricks, GrowingCell& cell) {
  if (!bricks.isAllFusible(slab, cell.occupancy)) return false;
  const std::size_t num_before = cell.absorbed.size();
  bool is_tiled = true;
  bricks.visitFused(slab, [&](const Cuboid& cuboid) {
    is_tiled = slab.contains(cuboid.box);
    if (is_tiled) cell.absorbed.push_back(cuboid.box);
    return is_tiled ? Visit::kContinue : Visit::kStop;
  });
  if (!is_tiled) {
    cell.absorbed.resize(num_before);
    return false;
  }
  cell.box = unite(cell.box, slab);
  return true;
}

std::vector<Cell> GrowthRules::startersOf(const VoxelStore::PendingChange& /*change*/,
                                          const std::vector<BrickUpdate>& observed,
                                          const std::vector<Cell>& samples) const {
  std::vector<Cell> cells;
  for (const BrickUpdate& brick : observed) {
    forEachCell(brick.brick, brick.hits, [&](const Cell& cell) { cells.push_back(cell); });
  }
  cells.insert(cells.end(), samples.begin(), samples.end());
  return cells;
}

bool GrowthRules::expand(GrowingBricks& bricks, GrowingCell& cell) const {
  for (const SearchDirection direction : paperDirections(cell.box.size())) {
    if (absorbSlab(slabOf(cell.box, direction, 1), bricks, cell)) return true;
  }
  return false;
}

}  // namespace cuboid_mapping
