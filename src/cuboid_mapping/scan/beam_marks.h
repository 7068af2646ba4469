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

/// How BrickMarks::misses[1] and [2] are laid out: as the function that marks beams writes them.
enum class MarkLayout : unsigned char {
  kPlanes,  ///< markSlabs(): [1] word z, bit 8 * x + y; [2] word y, bit 8 * x + z.
  kSlabs,   ///< markSlabsAvx2(): [1] word y, bit 8 * z + x; [2] word x, bit 8 * z + y.
};

/// The voxels of one brick that the beams of a cloud have marked. Each mask is a cache line.
struct alignas(64) BrickMarks {
  BrickMask hits{};  ///< Voxels in which a beam ends.
  /// Misses, of beams that are longest along different axes; the first is as any BrickMask.
  std::array<BrickMask, 3> misses{};

  /// All misses.
  [[nodiscard]] BrickMask collectMisses(MarkLayout layout) const;
  /// Asks the processor to fetch them. Inline: gcc drops calls of functions that do nothing else.
  [[gnu::always_inline]] void prefetch() const {
    __builtin_prefetch(&hits);
    for (const BrickMask& mask : misses) __builtin_prefetch(&mask);
  }
};

/// All bricks that beams have marked: a hash table by brick number.
class BeamMarks {
 public:
  /// The marks of a brick, which is added when it is new. Stays where it is until clear().
  BrickMarks& findOrAdd(BrickKey key) {
    const std::size_t slot = slotOf(key);
    return slots_[slot].marks != nullptr ? *slots_[slot].marks : add(key);
  }

  /// Bricks that were added since clear().
  [[nodiscard]] std::size_t size() const { return keys_.size(); }
  /// A brick and its marks. @param index  In the order in which the bricks were added.
  ///@{
  [[nodiscard]] BrickKey key(std::size_t index) const { return keys_[index]; }
  [[nodiscard]] const BrickMarks& operator[](std::size_t index) const {
    return blocks_[index / kBlockBricks][index % kBlockBricks];
  }
  ///@}

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
  std::vector<BrickKey> keys_;
};

}  // namespace cuboid_mapping
