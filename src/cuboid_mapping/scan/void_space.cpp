// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/void_space.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace cuboid_mapping {
namespace {

/// A brick of the voxels that a cloud passes.
struct PassedBrick {
  Cell brick;
  BrickMask voxels;
  /// Numbers of the bricks before and after it on each axis; 0: there is none.
  std::array<std::array<std::uint32_t, 2>, 3> beside{};
};

/// The voxels that a cloud passes; the first item is no brick.
std::vector<PassedBrick> passedBy(const ScanUpdate& update) {
  std::vector<PassedBrick> passed(1);
  passed.reserve(update.bricks.size() + 1);
  for (const BrickUpdate& brick : update.bricks) {
    const BrickMask voxels = (brick.misses | brick.grazes).without(brick.hits);
    if (!voxels.isEmpty()) passed.push_back({brick.brick, voxels});
  }
  return passed;
}

/// Removes the voxels that have a neighbour along the axis outside the set.
void erode(std::vector<PassedBrick>& passed, int axis) {
  const auto beside = static_cast<std::size_t>(axis);
  std::vector<BrickMask> before(passed.size());
  for (std::size_t i = 0; i < passed.size(); ++i) before[i] = passed[i].voxels;
  for (std::size_t i = 1; i < passed.size(); ++i) {
    const auto& [previous, next] = passed[i].beside[beside];
    passed[i].voxels &= neighborsIn(before[i], before[previous], axis, -1) &
                        neighborsIn(before[i], before[next], axis, 1);
  }
}

}  // namespace

void VoidSpace::add(const ScanUpdate& update) {
  if (!isOrdered(update.bricks)) return add(unite(update, {}));
  ++num_clouds_;
  std::vector<PassedBrick> passed = passedBy(update);
  std::unordered_map<Cell, std::uint32_t, CellHash> numbers;
  numbers.reserve(passed.size());
  for (std::uint32_t i = 1; i < passed.size(); ++i) numbers.emplace(passed[i].brick, i);
  for (std::uint32_t i = 1; i < passed.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      Cell previous = passed[i].brick;
      previous[axis] -= kBrickEdge;
      const auto found = numbers.find(previous);
      ++num_look_ups_;
      if (found == numbers.end()) continue;
      passed[i].beside[static_cast<std::size_t>(axis)][0] = found->second;
      passed[found->second].beside[static_cast<std::size_t>(axis)][1] = i;
    }
  }
  for (int axis = 0; axis < 3; ++axis) erode(passed, axis);
  for (const PassedBrick& brick : passed) {
    if (brick.voxels.isEmpty()) continue;
    pages_[pageOf(brick.brick)] = num_clouds_;  // First: a brick without its page would stay.
    bricks_[brick.brick] |= brick.voxels;
  }
  touch(update);
}

void VoidSpace::touch(const ScanUpdate& update) {
  std::optional<Cell> last;  // Neighbours in the update mostly share a page.
  for (const BrickUpdate& brick : update.bricks) {
    const Cell page = pageOf(brick.brick);
    if (last == page) continue;
    last = page;
    const auto found = pages_.find(page);
    if (found != pages_.end()) found->second = num_clouds_;
  }
}

void VoidSpace::forgetOutside(const CellBox& box, std::uint64_t idle_clouds) {
  for (auto page = pages_.begin(); page != pages_.end();) {
    const CellBox cells = pageBox(page->first);
    if (cells.intersects(box) || page->second + idle_clouds > num_clouds_) {
      ++page;
      continue;
    }
    forEachBrick(cells, [this](const Cell& brick) { bricks_.erase(brick); });
    page = pages_.erase(page);
  }
}

ScanUpdate VoidSpace::withoutMoving(const ScanUpdate& update) const {
  ScanUpdate rest = update;
  for (BrickUpdate& brick : rest.bricks) {
    const BrickMask moving = brick.hits & of(brick.brick);
    if (moving.isEmpty()) continue;
    brick.hits = brick.hits.without(moving);
    brick.misses = brick.misses.without(moving);
    brick.grazes = brick.grazes.without(moving);
  }
  const auto is_empty = [](const BrickUpdate& brick) { return isEmpty(brick); };
  rest.bricks.erase(std::remove_if(rest.bricks.begin(), rest.bricks.end(), is_empty),
                    rest.bricks.end());
  return rest;
}

VoidSpace VoidSpace::moved(const VoxelMotion& motion) const {
  VoidSpace other;
  other.num_clouds_ = num_clouds_;
  for (const auto& [brick, mask] : bricks_) {
    forEachCell(brick, mask, [&](const Cell& cell) {
      const CellBox at = motion(CellBox::ofCell(cell));
      if (!at.isEmpty()) other.bricks_[brickOf(at.min)].set(voxelIndex(at.min));
    });
  }
  for (const auto& [brick, mask] : other.bricks_) other.pages_[pageOf(brick)] = num_clouds_;
  return other;
}

}  // namespace cuboid_mapping
