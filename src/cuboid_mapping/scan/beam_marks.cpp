// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/beam_marks.h"

#include <algorithm>

namespace cuboid_mapping {
namespace {

/// Swaps rows and columns of 8 x 8 bits: bit 8 * i + j goes to 8 * j + i.
std::uint64_t transpose(std::uint64_t word) {
  std::uint64_t swapped = (word ^ word >> 7) & 0x00AA00AA00AA00AAULL;
  word ^= swapped ^ swapped << 7;
  swapped = (word ^ word >> 14) & 0x0000CCCC0000CCCCULL;
  word ^= swapped ^ swapped << 14;
  swapped = (word ^ word >> 28) & 0x00000000F0F0F0F0ULL;
  return word ^ swapped ^ swapped << 28;
}

/// transpose() of each word.
BrickMask transposeWords(BrickMask mask) {
  for (std::size_t i = 0; i < kBrickEdge; ++i) mask[i] = transpose(mask[i]);
  return mask;
}

/// Moves byte j of word i to byte i of word j.
BrickMask transposeBytes(BrickMask mask) {
  const auto swap = [&mask](std::size_t distance, std::uint64_t low_bytes) {
    for (std::size_t i = 0; i < kBrickEdge; ++i) {
      if ((i & distance) != 0) continue;
      const std::uint64_t swapped = (mask[i] >> (8 * distance) ^ mask[i + distance]) & low_bytes;
      mask[i + distance] ^= swapped;
      mask[i] ^= swapped << (8 * distance);
    }
  };
  swap(4, 0x00000000FFFFFFFFULL);
  swap(2, 0x0000FFFF0000FFFFULL);
  swap(1, 0x00FF00FF00FF00FFULL);
  return mask;
}

}  // namespace

BrickMask BrickMarks::collectMisses() const {
  BrickMask all = misses[0];
  if (!misses[1].isEmpty()) all |= transposeBytes(misses[1]);
  if (!misses[2].isEmpty()) all |= transposeWords(transposeBytes(misses[2]));
  return all;
}

void BeamMarks::clear() {
  if (slots_.size() > kFirstSlots && 16 * size() < slots_.size()) {
    // The next cloud would pay for a long one before it. By halves, since the next one may be long again.
    slots_ = std::vector<Slot>(slots_.size() / 2);
    last_slot_ = slots_.size() - 1;
    blocks_.resize(std::min(blocks_.size(), slots_.size() / 4 / kBlockBricks));
    std::vector<BrickKey>().swap(keys_);
    return;
  }
  std::fill(slots_.begin(), slots_.end(), Slot());
  keys_.clear();
}

BrickMarks& BeamMarks::add(BrickKey key) {
  const std::size_t index = size();
  if (4 * (index + 1) > slots_.size()) {
    std::vector<Slot> old(2 * slots_.size());
    old.swap(slots_);
    last_slot_ = slots_.size() - 1;
    for (const Slot& slot : old) {
      if (slot.marks != nullptr) slots_[slotOf(slot.key)] = slot;
    }
  }
  if (index == blocks_.size() * kBlockBricks) {
    blocks_.push_back(std::make_unique<BrickMarks[]>(kBlockBricks));
  }
  keys_.push_back(key);
  BrickMarks& marks = blocks_[index / kBlockBricks][index % kBlockBricks];
  marks = BrickMarks();
  slots_[slotOf(key)] = {key, &marks};
  return marks;
}

}  // namespace cuboid_mapping
