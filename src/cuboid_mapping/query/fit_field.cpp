// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/fit_field.h"

#include <algorithm>
#include <cstring>

namespace cuboid_mapping {
namespace {

/// Minimum cost of a kept brick, for its memory.
constexpr std::uint64_t kKeptBrick = 8;
/// Maximum number of bricks that a box may reach from one: more take too much memory.
constexpr double kMaxReached = 1e6;

/// Bricks that a box of this edge can reach along an axis from a brick.
constexpr std::int32_t numReached(std::int32_t edge) { return (edge + 6) / kBrickEdge + 1; }

/// Bits 8 * y + x of `near`, moved by `by` (0 to 8) towards lower x; `far` follows it.
std::uint64_t shiftRows(std::uint64_t near, std::uint64_t far, int by) {
  if (by == 0) return near;
  if (by == kBrickEdge) return far;
  return (near >> by & kFirstOfEachRow * (0xFFU >> by)) |
         (far << (8 - by) & kFirstOfEachRow * (0xFFU << (8 - by) & 0xFFU));
}

std::uint64_t loadWord(const std::uint8_t* bytes) {
  std::uint64_t word = 0;
  std::memcpy(&word, bytes, sizeof(word));
  return word;
}

}  // namespace

const BrickMask& FitField::inBrick(const Cell& brick) {
  if (const FitBrick* known = bricks_.find(brick)) return known->places;
  static const BrickMask kNone;
  const double num_reached = 1.0 * numReached(size_.x) * numReached(size_.y) * numReached(size_.z);
  if (num_reached > kMaxReached) budget().end(BudgetLimit::kBricks);
  if (!budget().spend(0)) return kNone;
  std::uint64_t num_read = 0;
  const BrickMask places = compute(brick, num_read);
  if (!budget().spend(std::max(kKeptBrick, num_read))) return kNone;
  return bricks_.findOrAdd(brick).places = places;
}

/// Rows of 8 + size - 1 along y, so that every box that starts in the brick is covered.
/// @param layer  Least brick of a layer that the box reaches.
void FitField::fillRows(const Cell& layer) {
  const Cell reached{numReached(size_.x), numReached(size_.y), 1};
  const auto num_rows = static_cast<std::size_t>(reached.y) * kBrickEdge;
  rows_.resize(num_rows * kBrickEdge);
  along_x_.resize(static_cast<std::size_t>(reached.x) + 1);
  for (std::int32_t y = 0; y < reached.y; ++y) {
    for (std::int32_t x = 0; x < reached.x; ++x) {
      along_x_[static_cast<std::size_t>(x)] =
          obstacles_.inBrick(layer + Cell{x * kBrickEdge, y * kBrickEdge, 0});
    }
    for (std::size_t slice = 0; slice < kBrickEdge; ++slice) {
      std::uint64_t blocked = 0;
      for (std::int32_t by = 0; by < size_.x; ++by) {
        const auto at = static_cast<std::size_t>(by / kBrickEdge);
        blocked |= shiftRows(along_x_[at][slice], along_x_[at + 1][slice], by % kBrickEdge);
      }
      std::memcpy(&rows_[slice * num_rows + static_cast<std::size_t>(y) * kBrickEdge], &blocked,
                  sizeof(blocked));
    }
  }
}

/// Ends with the layer that leaves no place. @param num_read  Raised by the number of read bricks.
BrickMask FitField::compute(const Cell& brick, std::uint64_t& num_read) {
  const auto num_rows = static_cast<std::size_t>(numReached(size_.y)) * kBrickEdge;
  BrickMask fits = BrickMask::all();
  const auto edge = static_cast<std::size_t>(size_.z);
  for (std::size_t z = 0; z < edge + kBrickEdge - 1 && !fits.isEmpty(); ++z) {
    const std::size_t slice = z % kBrickEdge;
    if (slice == 0) {
      fillRows(brick + Cell{0, 0, static_cast<std::int32_t>(z)});
      num_read += static_cast<std::uint64_t>(numReached(size_.x)) * numReached(size_.y);
    }
    std::uint64_t blocked = 0;
    for (std::size_t y = 0; y < static_cast<std::size_t>(size_.y); ++y) {
      blocked |= loadWord(&rows_[slice * num_rows + y]);
    }
    // The boxes whose slices include this one.
    const std::size_t last = std::min<std::size_t>(z, kBrickEdge - 1);
    for (std::size_t at = z + 1 > edge ? z + 1 - edge : 0; at <= last; ++at) fits[at] &= ~blocked;
  }
  return fits;
}

}  // namespace cuboid_mapping
