// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/brick.h"

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace cuboid_mapping {

/// Bits of a brick's number along each axis, which limit the bricks of one cloud.
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
  /// Misses of beams along z, y and x, one word for each slab of the brick: [0] word z, bit 8 * y + x, as in
  /// any BrickMask; [1] word y, bit 8 * z + x; [2] word x, bit 8 * z + y.
  std::array<BrickMask, 3> misses{};

  /// All misses.
  [[nodiscard]] BrickMask collectMisses() const;
  /// Prefetches the masks. Inline: gcc drops calls of functions that do nothing else.
  [[gnu::always_inline]] void prefetch() const {
    __builtin_prefetch(&hits);
    for (const BrickMask& mask : misses) __builtin_prefetch(&mask);
  }
};

/// All bricks that beams have marked: a hash table by brick number.
class BeamMarks {
 public:
  /// Finds or adds the marks of a brick. They do not move until clear().
  BrickMarks& findOrAdd(BrickKey key) {
    const std::size_t slot = slotOf(key);
    return slots_[slot].marks != nullptr ? *slots_[slot].marks : add(key);
  }

  /// Number of bricks added since clear().
  [[nodiscard]] std::size_t size() const { return keys_.size(); }
  /// A brick and its marks. @param index  Index in the order of addition.
  ///@{
  [[nodiscard]] BrickKey key(std::size_t index) const { return keys_[index]; }
  [[nodiscard]] const BrickMarks& operator[](std::size_t index) const {
    return blocks_[index / kBlockBricks][index % kBlockBricks];
  }
  ///@}

  /// Forgets all bricks. Keeps the memory, or half of it if the bricks took a small part.
  void clear();

  /// Bytes held from the allocator.
  [[nodiscard]] std::size_t numBytes() const {
    return slots_.capacity() * sizeof(Slot) + blocks_.size() * kBlockBricks * sizeof(BrickMarks) +
           keys_.capacity() * sizeof(BrickKey);
  }

 private:
  struct Slot {
    BrickKey key = 0;
    BrickMarks* marks = nullptr;
  };
  static constexpr std::size_t kBlockBricks = 256;
  static constexpr std::size_t kFirstSlots = 4096;

  [[nodiscard]] std::size_t slotOf(BrickKey key) const {
    constexpr std::uint64_t kGoldenRatio = 0x9E3779B97F4A7C15ULL;
    const Slot* slots = slots_.data();
    std::size_t slot = (key * kGoldenRatio) >> 32 & last_slot_;
    while (slots[slot].marks != nullptr && slots[slot].key != key) slot = (slot + 1) & last_slot_;
    return slot;
  }
  BrickMarks& add(BrickKey key);

  std::size_t last_slot_ = kFirstSlots - 1;
  /// Slots, at most a quarter in use: long searches are hard to predict.
  std::vector<Slot> slots_ = std::vector<Slot>(kFirstSlots);
  std::vector<std::unique_ptr<BrickMarks[]>> blocks_;
  std::vector<BrickKey> keys_;
};

}  // namespace cuboid_mapping
