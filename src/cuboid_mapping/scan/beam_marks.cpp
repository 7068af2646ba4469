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

/// Word of BrickMarks::slabs.
constexpr std::size_t wordOfSlab(std::size_t slab) { return slab / 2 + slab % 2 * 4; }

/// Byte z of the words of one slab each: the bytes become words.
BrickMask turnSlabs(const BrickMask& slabs) {
  BrickMask turned{};
  for (std::size_t slab = 0; slab < kBrickEdge; ++slab) {
    const std::uint64_t word = slabs[wordOfSlab(slab)];
    for (std::size_t z = 0; z < kBrickEdge; ++z)
      turned[z] |= (word >> (8 * z) & 0xFF) << (8 * slab);
  }
  return turned;
}

}  // namespace

BrickMask BrickMarks::collectMisses() const {
  BrickMask all = misses[0];
  for (std::size_t z = 0; z < kBrickEdge; ++z) {
    if (misses[1][z] != 0) all[z] |= transpose(misses[1][z]);
  }
  for (std::size_t y = 0; y < kBrickEdge; ++y) {
    if (misses[2][y] == 0) continue;
    const std::uint64_t rows = transpose(misses[2][y]);  // Bit 8 * z + x.
    for (std::size_t z = 0; z < kBrickEdge; ++z) all[z] |= (rows >> (8 * z) & 0xFF) << (8 * y);
  }
  if (!slabs[0].isEmpty()) {
    const BrickMask turned = turnSlabs(slabs[0]);  // Bit 8 * x + y.
    for (std::size_t z = 0; z < kBrickEdge; ++z) all[z] |= transpose(turned[z]);
  }
  if (!slabs[1].isEmpty()) all |= turnSlabs(slabs[1]);
  for (std::size_t z = 0; z < kBrickEdge; ++z) all[z] |= slabs[2][wordOfSlab(z)];
  return all;
}

void BeamMarks::clear() {
  std::fill(slots_.begin(), slots_.end(), Slot());
  size_ = 0;
}

BrickMarks& BeamMarks::add(BrickKey key) {
  if (4 * (size_ + 1) > slots_.size()) {
    std::vector<Slot> old(2 * slots_.size());
    old.swap(slots_);
    last_slot_ = slots_.size() - 1;
    for (const Slot& slot : old) {
      if (slot.marks != nullptr) slots_[slotOf(slot.key)] = slot;
    }
  }
  if (size_ == blocks_.size() * kBlockBricks) {
    blocks_.push_back(std::make_unique<BrickMarks[]>(kBlockBricks));
  }
  BrickMarks& marks = blocks_[size_ / kBlockBricks][size_ % kBlockBricks];
  marks = BrickMarks();
  marks.key = key;
  ++size_;
  slots_[slotOf(key)] = {key, &marks};
  return marks;
}

}  // namespace cuboid_mapping
