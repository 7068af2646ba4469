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
    held_[brick][static_cast<std::size_t>(cell.z & 7)] |= voxelBit(cell);
  });
}

void SettlingCells::noteChanges(const Cell& brick, const BrickMask& cells, std::uint64_t cloud) {
  const auto held = held_.find(brick);
  if (held == held_.end()) return;
  BrickMask changed = held->second;
  for (std::size_t z = 0; z < kBrickEdge; ++z) changed[z] &= cells[z];
  forEachCell(brick, changed, [&](const Cell& cell) { last_change_[cell] = cloud; });
}

std::vector<Cell> SettlingCells::release(std::uint64_t cloud) {
  std::vector<Cell> released;
  while (!due_.empty() && due_.begin()->first <= cloud) {
    const std::vector<Cell> cells = std::move(due_.begin()->second);
    due_.erase(due_.begin());
    for (const Cell& cell : cells) {
      const auto last_change = last_change_.find(cell);
      if (last_change->second + clouds_ > cloud) {  // It has changed meanwhile.
        due_[last_change->second + clouds_].push_back(cell);
        continue;
      }
      last_change_.erase(last_change);
      const auto held = held_.find(brickOf(cell));
      held->second[static_cast<std::size_t>(cell.z & 7)] &= ~voxelBit(cell);
      if (held->second == BrickMask{}) held_.erase(held);
      released.push_back(cell);
    }
  }
  return released;
}

BrickMask SettlingCells::heldIn(const Cell& brick) const {
  const auto held = held_.find(brick);
  return held == held_.end() ? BrickMask{} : held->second;
}

void SettlingCells::clear() {
  due_.clear();
  held_.clear();
  last_change_.clear();
}

}  // namespace cuboid_mapping
