// SPDX-License-Identifier: BSD-3-Clause
// Boxes as sets of cells.
#pragma once

#include "support/voxel_map.h"

#include <algorithm>
#include <set>
#include <vector>

namespace cuboid_mapping::test {

[[nodiscard]] inline std::set<Cell> cellsOfBoxes(const std::vector<CellBox>& boxes) {
  std::set<Cell> cells;
  for (const CellBox& box : boxes) {
    visitCells(box, [&](const Cell& cell) { cells.insert(cell); });
  }
  return cells;
}

[[nodiscard]] inline bool isAnyShared(const CellBox& box, const std::vector<CellBox>& others) {
  return std::any_of(others.begin(), others.end(),
                     [&](const CellBox& other) { return !intersect(box, other).isEmpty(); });
}

}  // namespace cuboid_mapping::test
