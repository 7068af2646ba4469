// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace cuboid_mapping {

/// A set of columns at one plane, in tiles of 8 x 8: bit 8 * row + column, as the words of BrickMarks::misses.
class PlaneColumns {
 public:
  /// Empties the set, for columns in a range of tiles on each axis.
  void reset(const std::array<int, 2>& first_tile, const std::array<int, 2>& last_tile) {
    first_ = first_tile;
    for (std::size_t i = 0; i < 2; ++i) size_[i] = last_tile[i] - first_tile[i] + 1;
    words_.assign(static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(size_[1]), 0);
  }

  /// The tiles, from first() to before first() + size().
  ///@{
  [[nodiscard]] const std::array<int, 2>& first() const { return first_; }
  [[nodiscard]] const std::array<int, 2>& size() const { return size_; }
  ///@}

  /// Columns of a tile that is in the range.
  [[nodiscard]] std::uint64_t& at(int x, int y) { return words_[indexOf(x, y)]; }
  /// Columns of any tile.
  [[nodiscard]] std::uint64_t of(int x, int y) const {
    const bool is_in =
        x >= first_[0] && x - first_[0] < size_[0] && y >= first_[1] && y - first_[1] < size_[1];
    return is_in ? words_[indexOf(x, y)] : 0;
  }

 private:
  [[nodiscard]] std::size_t indexOf(int x, int y) const {
    return static_cast<std::size_t>(y - first_[1]) * static_cast<std::size_t>(size_[0]) +
           static_cast<std::size_t>(x - first_[0]);
  }

  std::array<int, 2> first_{};
  std::array<int, 2> size_{};
  std::vector<std::uint64_t> words_;
};

/// Columns whose neighbour `right` columns and `up` rows further is in a set: each -1, 0 or 1.
/// @param of  Gives the columns of a tile: of(x, y).
template <typename TilesT>
[[nodiscard]] std::uint64_t neighbours(const TilesT& of, int x, int y, int right, int up) {
  const auto row_shifted = [&](int tile_x) {
    const std::uint64_t word = of(tile_x, y);
    if (up > 0) return word >> 8 | of(tile_x, y + 1) << 56;
    if (up < 0) return word << 8 | of(tile_x, y - 1) >> 56;
    return word;
  };
  constexpr std::uint64_t kFirstColumn = 0x0101010101010101;
  constexpr std::uint64_t kLastColumn = kFirstColumn << 7;
  const std::uint64_t word = row_shifted(x);
  if (right > 0) return (word >> 1 & ~kLastColumn) | (row_shifted(x + 1) & kFirstColumn) << 7;
  if (right < 0) return (word << 1 & ~kFirstColumn) | (row_shifted(x - 1) & kLastColumn) >> 7;
  return word;
}

}  // namespace cuboid_mapping
