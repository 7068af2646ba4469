// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/query/obstacles.h"

#include <unordered_map>
#include <vector>

namespace cuboid_mapping {

/// Places at which a box of whole voxels fits between the obstacles: the free space, eroded by the box.
///
/// A place of the box is named by its least cell. Bricks of places are computed when they are asked
/// for, and kept: what changes in the map afterwards is not seen. Not thread-safe.
class FitField {
 public:
  /// @param size  Edges of the box in voxels, >= 1. @param obstacles  Must outlive this object.
  FitField(const Obstacles& obstacles, const Cell& size) : obstacles_(obstacles), size_(size) {}

  /// Edges of the box in voxels.
  [[nodiscard]] const Cell& size() const { return size_; }
  /// That of the obstacles.
  [[nodiscard]] Budget& budget() const { return obstacles_.budget(); }

  /// The places in a brick; none when the budget of the obstacles is spent.
  /// @complexity O(size / 8 + 1) for each edge, multiplied; O(1) again.
  [[nodiscard]] const BrickMask& inBrick(const Cell& brick);

  /// Whether the box fits at a place.
  [[nodiscard]] bool fits(const Cell& place) {
    const auto voxel = static_cast<std::size_t>(voxelIndex(place));
    return (inBrick(brickOf(place))[voxel >> 6] >> (voxel & 63) & 1) != 0;
  }

  /// The voxels that the box covers at a box of places, taken together.
  [[nodiscard]] CellBox coveredAt(const CellBox& places) const {
    return {places.min, places.max + size_ - Cell{1, 1, 1}};
  }
  /// The places at which the box lies in a box of voxels; empty when it does not fit.
  [[nodiscard]] CellBox placesIn(const CellBox& voxels) const {
    return {voxels.min, voxels.max - size_ + Cell{1, 1, 1}};
  }

 private:
  [[nodiscard]] bool spendForBrick() const;
  [[nodiscard]] BrickMask compute(const Cell& brick);
  void fillRows(const Cell& brick);

  const Obstacles& obstacles_;
  Cell size_;
  std::unordered_map<Cell, BrickMask, CellHash> bricks_;
  /// Of one brick: byte (z, y) has a bit for each x at which some voxel of the box's row there is in
  /// the way.
  std::vector<std::uint8_t> rows_;
};

}  // namespace cuboid_mapping
