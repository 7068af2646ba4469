// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/voxels/brick_cuboids.h"

#include <new>

namespace cuboid_mapping {
namespace {

constexpr PackedBox packBox(int corner, int width, int height, int depth) {
  return static_cast<PackedBox>(corner | (width - 1) << 9 | (height - 1) << 12 | (depth - 1) << 15);
}

/// Finds the largest box in the mask with this least corner, and removes it from the mask.
PackedBox takeLargestBox(BrickMask& mask, int z, int voxel) {
  const int x = voxel & 7;
  const int y = voxel >> 3;
  int best_volume = 0;
  int best_width = 0;
  int best_height = 0;
  int best_depth = 0;
  int widest = 8;                // Width of the first row, down to the current slice.
  std::uint64_t column = ~0ULL;  // Voxels that are in all slices up to the current one.
  for (int depth = 1; z + depth <= kBrickEdge; ++depth) {
    column &= mask[z + depth - 1] >> voxel;
    if ((column & 1) == 0) break;
    std::uint64_t row = 0xFFU >> x;  // Voxels that are in all rows up to the current one.
    for (int height = 1; y + height <= kBrickEdge; ++height) {
      row &= column >> (8 * (height - 1));
      const int width = __builtin_ctzll(~row);
      if (height == 1) widest = width;
      if (width == 0) break;
      const int volume = width * height * depth;
      if (volume > best_volume) {
        best_volume = volume;
        best_width = width;
        best_height = height;
        best_depth = depth;
      }
    }
    // No deeper box can be larger.
    if (widest * (kBrickEdge - y) * (kBrickEdge - z) <= best_volume) break;
  }
  const std::uint64_t rows = kFirstOfEachRow >> (8 * (8 - best_height));
  const std::uint64_t taken = (((1ULL << best_width) - 1) * rows) << voxel;
  for (int i = z; i < z + best_depth; ++i) mask[i] &= ~taken;
  return packBox(z << 6 | voxel, best_width, best_height, best_depth);
}

}  // namespace

void DividedBrick::add(BrickMask voxels) noexcept {
  if (voxels.isFull()) {
    boxes[static_cast<std::size_t>(count++)] = packBox(0, kBrickEdge, kBrickEdge, kBrickEdge);
    return;
  }
  for (int z = 0; z < kBrickEdge; ++z) {
    while (voxels[z] != 0) {
      boxes[static_cast<std::size_t>(count++)] =
          takeLargestBox(voxels, z, __builtin_ctzll(voxels[z]));
    }
  }
}

void divideVoxels(const Cell& brick, const BrickMask& voxels, Occupancy occupancy,
                  std::vector<Cuboid>& cuboids) {
  DividedBrick divided;
  divided.add(voxels);
  for (int i = 0; i < divided.count; ++i) {
    cuboids.push_back(unpackCuboid(brick, divided.box(i), occupancy));
  }
}

void divideBrick(const VoxelBrick& brick, std::vector<Cuboid>& cuboids) {
  divideVoxels(brick.brick, brick.voxels.occupied(), Occupancy::kOccupied, cuboids);
  divideVoxels(brick.brick, brick.voxels.free(), Occupancy::kFree, cuboids);
}

BrickCuboids::Word BrickCuboids::pack(const DividedBrick& divided) {
  static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "the low bits of a box come first");
  if (divided.count <= kMostInline) {
    Word word = kInline | static_cast<Word>(divided.count) << 1 |
                static_cast<Word>(divided.num_occupied) << 3;
    for (int i = 0; i < divided.count; ++i) {
      word |= Word{divided.boxes[static_cast<std::size_t>(i)]} << (5 + kBoxBits * i);
    }
    return word;
  }
  auto* block = new std::byte[blockBytes(divided.count)];
  std::uint32_t word = static_cast<std::uint32_t>(divided.num_occupied) << kCountBits |
                       static_cast<std::uint32_t>(divided.count);
  std::memcpy(block, &word, sizeof(word));
  word >>= 8 * byteOf(0);  // From here on with bits of what lies before the box.
  for (int i = 0; i < divided.count; ++i) {
    word |= divided.boxes[static_cast<std::size_t>(i)] << shiftOf(i);
    std::memcpy(block + byteOf(i), &word, sizeof(word));
    word >>= 8 * (byteOf(i + 1) - byteOf(i));
  }
  return reinterpret_cast<Word>(block);
}

void BrickCuboids::release(Word word) noexcept {
  if (word != kStale && (word & kInline) == 0) delete[] blockOf(word);
}

void BrickCuboids::keep(const DividedBrick& divided) const noexcept {
  try {
    const Word word = pack(divided);
    Word expected = kStale;
    if (!word_.compare_exchange_strong(expected, word, std::memory_order_acq_rel)) release(word);
  } catch (const std::bad_alloc&) {  // The next reader divides the brick again.
  }
}

std::size_t BrickCuboids::numBytes() const {
  const Word word = load();
  return word == kStale || (word & kInline) != 0 ? 0 : blockBytes(look().count);
}

}  // namespace cuboid_mapping
