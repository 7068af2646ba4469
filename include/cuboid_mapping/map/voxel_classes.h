// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/brick.h"
#include "cuboid_mapping/occupancy/sensor_model.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace cuboid_mapping {

/// Which voxels are known, and which are occupied, by brick: a directory beside the R-tree, derived
/// from it, for questions that a class answers. A voxel costs two bits, and only in bricks where
/// something is known. Const functions may run side by side.
class VoxelClasses {
 public:
  /// The voxels of one brick; a word per z slice as in BrickMask.
  struct Masks {
    const BrickMask* known;
    const BrickMask* occupied;  ///< A part of the known ones.
    bool is_any_occupied;
    bool is_all_free;  ///< All voxels are known, none is occupied.

    [[nodiscard]] Occupancy at(int voxel) const {
      const auto word = static_cast<std::size_t>(voxel >> 6);
      if (((*known)[word] >> (voxel & 63) & 1) == 0) return Occupancy::kUnknown;
      return ((*occupied)[word] >> (voxel & 63) & 1) != 0 ? Occupancy::kOccupied : Occupancy::kFree;
    }
  };

  VoxelClasses() { clear(); }

  void set(const Cell& brick, const BrickMask& known, const BrickMask& occupied);
  /// Gives all voxels of a box a class. @complexity O(bricks that the box shares a cell with).
  void fill(const CellBox& box, Occupancy occupancy);
  void clear();

  /// @return false when nothing is known in the brick. @complexity O(1).
  [[nodiscard]] bool find(const Cell& brick, Masks& masks) const {
    const Entry& entry = entries_[slotOf(brick)];
    if (entry.known == kNoMask) return false;
    const bool is_any_occupied = entry.occupied != kNothing;
    masks = {&mask(entry.known), &mask(entry.occupied), is_any_occupied,
             entry.known == kEverything && !is_any_occupied};
    return true;
  }

  [[nodiscard]] Occupancy at(const Cell& cell) const {
    Masks masks{};
    return find(brickOf(cell), masks) ? masks.at(voxelIndex(cell)) : Occupancy::kUnknown;
  }

  /// @complexity O(bricks that the box shares a cell with).
  [[nodiscard]] bool isAnyOccupied(const CellBox& box) const;

  /// Whether all voxels of a box that is not empty have this class, which is not unknown.
  /// @complexity O(bricks that the box shares a cell with).
  [[nodiscard]] bool isAll(const CellBox& box, Occupancy occupancy) const;

  /// Bytes held from the allocator.
  [[nodiscard]] std::size_t numBytes() const;

 private:
  using MaskIndex = std::uint32_t;
  static constexpr MaskIndex kNoMask = 0xFFFFFFFFU;
  static constexpr MaskIndex kNothing = 0;     ///< The mask of no voxel, which is shared.
  static constexpr MaskIndex kEverything = 1;  ///< The mask of all voxels.
  static constexpr std::size_t kBlockMasks = 256;

  /// A place of the hash table, which is probed linearly. At most half of them are taken.
  struct Entry {
    Cell brick;
    MaskIndex known = kNoMask;  ///< None: the place is free.
    MaskIndex occupied = kNoMask;
  };

  [[nodiscard]] const BrickMask& mask(MaskIndex index) const {
    return blocks_[index / kBlockMasks][index % kBlockMasks];
  }
  [[nodiscard]] std::size_t slotOf(const Cell& brick) const {
    const std::size_t last = entries_.size() - 1;
    std::size_t slot = CellHash()(brick) & last;
    while (entries_[slot].known != kNoMask && entries_[slot].brick != brick) {
      slot = (slot + 1) & last;
    }
    return slot;
  }
  void grow();
  [[nodiscard]] MaskIndex store(MaskIndex index, const BrickMask& mask);

  std::vector<Entry> entries_;
  std::size_t num_bricks_ = 0;
  std::vector<std::unique_ptr<BrickMask[]>> blocks_;
  std::vector<MaskIndex> free_masks_;
  MaskIndex num_masks_ = 0;
};

}  // namespace cuboid_mapping
