// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/query/obstacles.h"
#include "cuboid_mapping/voxels/brick_table.h"

#include <vector>

namespace cuboid_mapping {

/// Places at which a box of whole voxels fits between the obstacles: the free space, eroded by the box.
///
/// A place of the box is named by its least cell. Bricks of places are computed on request and kept: later
/// changes of the map are not seen. Not thread-safe.
class FitField {
 public:
  /// @param size  Edges of the box in voxels, >= 1. @param obstacles  Must outlive this object.
  FitField(const Obstacles& obstacles, const Cell& size) : obstacles_(obstacles), size_(size) {}

  /// Edges of the box in voxels.
  [[nodiscard]] const Cell& size() const { return size_; }
  /// The budget of the obstacles.
  [[nodiscard]] Budget& budget() const { return obstacles_.budget(); }

  /// The places in a brick; none when the budget of the obstacles is spent.
  /// @complexity O(bricks that the box reaches from this one); O(1) for a kept brick.
  [[nodiscard]] const BrickMask& inBrick(const Cell& brick);

  /// Whether the box fits at a place.
  [[nodiscard]] bool fits(const Cell& place) {
    const auto voxel = static_cast<std::size_t>(voxelIndex(place));
    return (inBrick(brickOf(place))[voxel >> 6] >> (voxel & 63) & 1) != 0;
  }

  /// All voxels that the box covers at some place in a box of places.
  [[nodiscard]] CellBox coveredAt(const CellBox& places) const {
    return {places.min, places.max + size_ - Cell{1, 1, 1}};
  }
  /// The places at which the box lies in a box of voxels; empty when it does not fit.
  [[nodiscard]] CellBox placesIn(const CellBox& voxels) const {
    return {voxels.min, voxels.max - size_ + Cell{1, 1, 1}};
  }

 private:
  struct FitBrick {
    Cell brick;
    BrickMask places;
  };

  [[nodiscard]] BrickMask compute(const Cell& brick, std::uint64_t& num_read);
  void fillRows(const Cell& layer);

  const Obstacles& obstacles_;
  Cell size_;
  BrickTable<FitBrick> bricks_;  ///< Freed at once: a search that ends by its time ends soon.
  /// Rows of one layer of bricks: byte (z, y) has bit x if an obstacle is in the row of the box that begins at x.
  std::vector<std::uint8_t> rows_;
  std::vector<BrickMask> along_x_;  ///< Obstacles of a line of bricks, and an empty one.
};

}  // namespace cuboid_mapping
