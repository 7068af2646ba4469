// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/cell_box.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace cuboid_mapping {

/// Edge of a brick in voxels, and its number of voxels. A brick is an aligned cube of voxels, named by its
/// least cell.
///@{
constexpr std::int32_t kBrickEdge = 8;
constexpr int kBrickVoxels = kBrickEdge * kBrickEdge * kBrickEdge;
///@}

/// Number of a voxel in its brick: 64 * z + 8 * y + x, 0 to 511.
[[nodiscard]] constexpr int voxelIndex(const Cell& cell) {
  return ((cell.z & 7) << 6) | ((cell.y & 7) << 3) | (cell.x & 7);
}

/// The first voxel of each row along x, in the word of a slice.
constexpr std::uint64_t kFirstOfEachRow = 0x0101010101010101ULL;

/// A set of voxels of one brick: a 64-bit word per z slice, bit 8 * y + x.
class BrickMask {
 public:
  /// The empty set.
  constexpr BrickMask() = default;

  /// All voxels of a brick.
  [[nodiscard]] static constexpr BrickMask all() { return ~BrickMask(); }

  /// The voxels of a box. @pre It is not empty, and lies in one brick.
  [[nodiscard]] static constexpr BrickMask ofBox(const CellBox& box) {
    const std::uint64_t row = ((1ULL << (box.max.x - box.min.x)) - 1) << (box.min.x & 7);
    const std::uint64_t rows = kFirstOfEachRow >> (8 * (8 - (box.max.y - box.min.y)));
    const std::uint64_t slice = (row * rows) << (8 * (box.min.y & 7));
    BrickMask mask;
    for (std::int32_t z = box.min.z; z < box.max.z; ++z) mask[z & 7] = slice;
    return mask;
  }

  /// The word of a slice. @pre 0 <= z < 8.
  ///@{
  template <typename IndexT>
  constexpr std::uint64_t& operator[](IndexT z) {
    return words_[static_cast<std::size_t>(z)];
  }
  template <typename IndexT>
  constexpr const std::uint64_t& operator[](IndexT z) const {
    return words_[static_cast<std::size_t>(z)];
  }
  ///@}

  /// Whether a voxel is in the set. @param voxel  See voxelIndex().
  [[nodiscard]] constexpr bool test(int voxel) const {
    return (words_[static_cast<std::size_t>(voxel >> 6)] >> (voxel & 63) & 1) != 0;
  }
  /// Adds a voxel. @param voxel  See voxelIndex().
  constexpr void set(int voxel) {
    words_[static_cast<std::size_t>(voxel >> 6)] |= 1ULL << (voxel & 63);
  }

  /// Whether no voxel is in the set.
  [[nodiscard]] constexpr bool isEmpty() const {
    std::uint64_t any = 0;
    for (const std::uint64_t word : words_) any |= word;
    return any == 0;
  }
  /// Whether all 512 voxels are in the set.
  [[nodiscard]] constexpr bool isFull() const {
    std::uint64_t all = ~0ULL;
    for (const std::uint64_t word : words_) all &= word;
    return all == ~0ULL;
  }
  /// Whether some voxel is in both sets.
  [[nodiscard]] constexpr bool intersects(const BrickMask& other) const {
    return !(*this & other).isEmpty();
  }
  /// Whether every voxel of the other set is in this one.
  [[nodiscard]] constexpr bool contains(const BrickMask& other) const {
    return other.without(*this).isEmpty();
  }
  /// Number of voxels.
  [[nodiscard]] constexpr int count() const {
    int count = 0;
    for (const std::uint64_t word : words_) count += __builtin_popcountll(word);
    return count;
  }

  /// The voxels that are not in the other set.
  [[nodiscard]] constexpr BrickMask without(const BrickMask& other) const { return *this & ~other; }

  /// Voxels that are in either set (|), in both (&), in one of them only (^).
  ///@{
  constexpr BrickMask& operator|=(const BrickMask& other) {
    for (std::size_t z = 0; z < words_.size(); ++z) words_[z] |= other.words_[z];
    return *this;
  }
  constexpr BrickMask& operator&=(const BrickMask& other) {
    for (std::size_t z = 0; z < words_.size(); ++z) words_[z] &= other.words_[z];
    return *this;
  }
  constexpr BrickMask& operator^=(const BrickMask& other) {
    for (std::size_t z = 0; z < words_.size(); ++z) words_[z] ^= other.words_[z];
    return *this;
  }
  friend constexpr BrickMask operator|(BrickMask a, const BrickMask& b) { return a |= b; }
  friend constexpr BrickMask operator&(BrickMask a, const BrickMask& b) { return a &= b; }
  friend constexpr BrickMask operator^(BrickMask a, const BrickMask& b) { return a ^= b; }
  ///@}
  /// The voxels of the brick that are not in the set.
  friend constexpr BrickMask operator~(BrickMask mask) {
    for (std::uint64_t& word : mask.words_) word = ~word;
    return mask;
  }
  /// Whether the same voxels are in both sets.
  ///@{
  friend constexpr bool operator==(const BrickMask& a, const BrickMask& b) {
    return (a ^ b).isEmpty();
  }
  friend constexpr bool operator!=(const BrickMask& a, const BrickMask& b) { return !(a == b); }
  ///@}

  /// Calls visit(voxel) for each voxel, in the order of voxelIndex().
  template <typename VisitorT>
  constexpr void forEach(VisitorT visit) const {
    for (int z = 0; z < kBrickEdge; ++z) {
      for (std::uint64_t left = (*this)[z]; left != 0; left &= left - 1) {
        visit(64 * z + __builtin_ctzll(left));
      }
    }
  }

 private:
  std::array<std::uint64_t, kBrickEdge> words_{};
};

/// The voxels of a brick whose neighbour along an axis is in a set.
/// @param step  1: the next neighbour, -1: the one before. @param here, there  The set in this brick, and in the next
///              one in that direction.
[[nodiscard]] constexpr BrickMask neighborsIn(const BrickMask& here, const BrickMask& there,
                                              int axis, int step) {
  BrickMask mask;
  for (int z = 0; z < kBrickEdge; ++z) {
    if (axis == 0) {
      mask[z] = step > 0
                    ? (here[z] >> 1 & ~(kFirstOfEachRow << 7)) | (there[z] & kFirstOfEachRow) << 7
                    : (here[z] << 1 & ~kFirstOfEachRow) | (there[z] >> 7 & kFirstOfEachRow);
    } else if (axis == 1) {
      mask[z] = step > 0 ? here[z] >> 8 | there[z] << 56 : here[z] << 8 | there[z] >> 56;
    } else {
      const int from = z + step;
      mask[z] = from >= 0 && from < kBrickEdge ? here[from] : there[from & (kBrickEdge - 1)];
    }
  }
  return mask;
}

}  // namespace cuboid_mapping
