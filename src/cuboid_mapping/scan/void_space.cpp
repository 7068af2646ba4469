// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/void_space.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

namespace cuboid_mapping {
namespace {

/// A brick and the voxels around it: 10 x 10 x 10, by z and y; bit x + 1 of a row.
using Rows = std::array<std::array<unsigned, kBrickEdge + 2>, kBrickEdge + 2>;

using BrickMasks = std::unordered_map<Cell, BrickMask, CellHash>;

/// The eight voxels of a row, which may lie in a neighbouring brick.
unsigned rowOf(const BrickMasks& masks, const Cell& first) {
  const auto found = masks.find(brickOf(first));
  if (found == masks.end()) return 0;
  return static_cast<unsigned>(found->second[first.z & 7] >> (8 * (first.y & 7)) & 0xFF);
}

Rows rowsAround(const BrickMasks& masks, const Cell& brick) {
  Rows rows{};
  for (std::size_t z = 0; z < rows.size(); ++z) {
    for (std::size_t y = 0; y < rows.size(); ++y) {
      const Cell first =
          brick + Cell{0, static_cast<std::int32_t>(y) - 1, static_cast<std::int32_t>(z) - 1};
      const unsigned before = rowOf(masks, first - Cell{kBrickEdge, 0, 0}) >> (kBrickEdge - 1);
      const unsigned after = rowOf(masks, first + Cell{kBrickEdge, 0, 0}) & 1U;
      rows[z][y] = before | rowOf(masks, first) << 1 | after << (kBrickEdge + 1);
    }
  }
  return rows;
}

/// Voxels of a brick that are in a set with all their neighbours.
BrickMask findInner(const BrickMasks& masks, const Cell& brick) {
  const Rows rows = rowsAround(masks, brick);
  BrickMask inner;
  for (std::size_t z = 0; z < kBrickEdge; ++z) {
    for (std::size_t y = 0; y < kBrickEdge; ++y) {
      unsigned all = ~0U;
      for (std::size_t i = 0; i < 9; ++i) all &= rows[z + i / 3][y + i % 3];
      inner[z] |= std::uint64_t{all & all >> 1 & all >> 2 & 0xFF} << (8 * y);
    }
  }
  return inner;
}

}  // namespace

void VoidSpace::add(const ScanUpdate& update) {
  ++num_clouds_;
  BrickMasks passed;
  passed.reserve(update.bricks.size());
  for (const BrickUpdate& brick : update.bricks) {
    const BrickMask mask = (brick.misses | brick.grazes).without(brick.hits);
    if (!mask.isEmpty()) passed[brick.brick] = mask;
  }
  for (const auto& [brick, mask] : passed) {
    const BrickMask inner = findInner(passed, brick);
    if (inner.isEmpty()) continue;
    bricks_[brick] |= inner;
    pages_[pageOf(brick)] = num_clouds_;
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
