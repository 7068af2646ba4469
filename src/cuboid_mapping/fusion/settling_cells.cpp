// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/settling_cells.h"

#include <utility>

namespace cuboid_mapping {

void SettlingCells::hold(const Cell& brick, const BrickMask& cells, std::uint64_t cloud) {
  if (clouds_ == 0) return;
  forEachCell(brick, cells, [&](const Cell& cell) {
    const bool is_new = last_change_.insert_or_assign(cell, cloud).second;
    if (!is_new) return;
    due_[cloud + clouds_].push_back(cell);
    held_.findOrAdd(brick).cells.set(voxelIndex(cell));
  });
}

void SettlingCells::noteChanges(const Cell& brick, const BrickMask& cells, std::uint64_t cloud) {
  forEachCell(brick, heldIn(brick) & cells, [&](const Cell& cell) { last_change_[cell] = cloud; });
}

std::vector<Cell> SettlingCells::release(std::uint64_t cloud) {
  std::vector<Cell> released;
  while (!due_.empty() && due_.begin()->first <= cloud) {
    const std::vector<Cell> cells = std::move(due_.begin()->second);
    due_.erase(due_.begin());
    for (const Cell& cell : cells) {
      const auto last_change = last_change_.find(cell);
      if (last_change->second + clouds_ > cloud) {  // The cell has changed meanwhile.
        due_[last_change->second + clouds_].push_back(cell);
        continue;
      }
      last_change_.erase(last_change);
      BrickMask& held = held_.findOrAdd(brickOf(cell)).cells;
      held &= ~BrickMask::ofBox(CellBox::ofCell(cell));
      if (held.isEmpty()) held_.erase(brickOf(cell));
      released.push_back(cell);
    }
  }
  return released;
}

BrickMask SettlingCells::heldIn(const Cell& brick) const {
  const HeldBrick* held = held_.find(brick);
  return held == nullptr ? BrickMask() : held->cells;
}

void SettlingCells::clear() {
  due_.clear();
  held_.clear();
  last_change_.clear();
}

}  // namespace cuboid_mapping
