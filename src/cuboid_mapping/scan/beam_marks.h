// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/brick.h"

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace cuboid_mapping {

/// Bricks that one cloud can number: bits of a brick's number along each axis.
constexpr int kBrickKeyBits = 21;

/// Number of a brick: 21 bits per axis, counted from the base of the cloud.
using BrickKey = std::uint64_t;

/// Number of the brick that holds a cell.
/// @param local  The cell of the brick minus the base: each coordinate in [0, 2^24).
[[nodiscard]] constexpr BrickKey toBrickKey(const Cell& local) {
  return static_cast<BrickKey>(local.x >> 3) |
         static_cast<BrickKey>(local.y >> 3) << kBrickKeyBits |
         static_cast<BrickKey>(local.z >> 3) << (2 * kBrickKeyBits);
}

/// The voxels of one brick that the beams of a cloud have marked. Each mask is a cache line.
struct alignas(64) BrickMarks {
  BrickMask hits{};  ///< Voxels in which a beam ends.
  /// Misses, by the axis along which the beam is longest. In the masks of that axis a word is a
  /// plane in which eight voxels along the axis are neighbouring bits:
  ///
  /// axis | word | bit
  /// -----|------|----------
  /// x    | z    | 8 * y + x: the layout of BrickMask
  /// y    | z    | 8 * x + y
  /// z    | y    | 8 * x + z
  std::array<BrickMask, 3> misses{};
  /// More misses, as markSlabsAvx2() writes them, by the axis along which the beam is longest. A word
  /// is a plane across that axis; those of slabs 0, 2, 4, 6 come before those of 1, 3, 5, 7.
  ///
  /// axis | bit
  /// -----|----------
  /// x    | 8 * z + y
  /// y    | 8 * z + x
  /// z    | 8 * y + x
  std::array<BrickMask, 3> slabs{};
  BrickKey key = 0;  ///< Of the brick.

  /// All misses in the layout of BrickMask.
  [[nodiscard]] BrickMask collectMisses() const;
};

/// All bricks that beams have marked: a hash table by brick number.
class BeamMarks {
 public:
  /// The marks of a brick, which is added when it is new. Stays where it is until clear().
  BrickMarks& at(BrickKey key) {
    const std::size_t slot = slotOf(key);
    return slots_[slot].marks != nullptr ? *slots_[slot].marks : add(key);
  }

  /// Bricks that were added since clear().
  [[nodiscard]] std::size_t size() const { return size_; }
  /// The marks of a brick. @param index  In the order in which the bricks were added.
  [[nodiscard]] const BrickMarks& operator[](std::size_t index) const {
    return blocks_[index / kBlockBricks][index % kBlockBricks];
  }

  /// Forgets all bricks, keeps the memory.
  void clear();

 private:
  struct Slot {
    BrickKey key = 0;
    BrickMarks* marks = nullptr;
  };
  static constexpr std::size_t kBlockBricks = 256;

  [[nodiscard]] std::size_t slotOf(BrickKey key) const {
    constexpr std::uint64_t kGoldenRatio = 0x9E3779B97F4A7C15ULL;
    const Slot* slots = slots_.data();
    std::size_t slot = (key * kGoldenRatio) >> 32 & last_slot_;
    while (slots[slot].marks != nullptr && slots[slot].key != key) slot = (slot + 1) & last_slot_;
    return slot;
  }
  BrickMarks& add(BrickKey key);

  std::size_t last_slot_ = 4095;
  /// At most a quarter of them are taken: a search that goes on is hard to foresee.
  std::vector<Slot> slots_ = std::vector<Slot>(last_slot_ + 1);
  std::vector<std::unique_ptr<BrickMarks[]>> blocks_;
  std::size_t size_ = 0;
};

}  // namespace cuboid_mapping
