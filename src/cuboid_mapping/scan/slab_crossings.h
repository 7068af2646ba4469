// SPDX-License-Identifier: BSD-3-Clause
// Crossings of borders across a beam's longest axis, for eight slabs of a brick at once.
#pragma once

#include "cuboid_mapping/scan/beam_marks.h"
#include "cuboid_mapping/scan/slab_phases.h"

#include <algorithm>
#include <cstdint>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace cuboid_mapping {

// All slabs of a brick; a set of them is a byte.
constexpr unsigned kAllSlabs = 0xFF;

/// Bits after the point in the phases of eight slabs, with 1 bit before it: whether the number of
/// borders crossed is odd, and the distance to the next.
constexpr int kLaneBits = 15;

/// Lanes for eight slabs; the compiler maps them to the machine's vectors.
using Lanes = std::uint16_t __attribute__((vector_size(16)));

/// Highest bits of the lanes: bit i for lane i of `low`, bit 8 + i for lane i of `high`.
inline unsigned highestBits(const Lanes& low, const Lanes& high) {
#ifdef __SSE2__
  return static_cast<unsigned>(_mm_movemask_epi8(
      _mm_packs_epi16(reinterpret_cast<__m128i>(low), reinterpret_cast<__m128i>(high))));
#else
  unsigned bits = 0;
  for (int i = 0; i < 8; ++i) bits |= (low[i] >> 15 | high[i] >> 15 << 8) << i;
  return bits;
#endif
}

/// Upper halves of the products.
inline Lanes multiplyHigh(const Lanes& a, const Lanes& b) {
#ifdef __SSE2__
  return reinterpret_cast<Lanes>(
      _mm_mulhi_epu16(reinterpret_cast<__m128i>(a), reinterpret_cast<__m128i>(b)));
#else
  Lanes product;
  for (int i = 0; i < 8; ++i) product[i] = (std::uint32_t{a[i]} * b[i]) >> 16;
  return product;
#endif
}

/// One of the two axes across the beam, on the walk from brick to brick. Coordinates are mirrored if
/// the beam goes down the axis, so that it always goes up.
struct CrossedAxis {
  int axis = 0;
  double t_first = 0.0;                          ///< Length at the first border, as in Ray.
  double t_delta = 0.0;                          ///< Length from one border to the next.
  std::int64_t phase = 1LL << (kPhaseBits - 1);  ///< Phase at the far end of the first slab.
  std::int64_t slope = 0;                        ///< Change of the phase per slab.
  int num_borders = 0;                           ///< Number of borders that the beam crosses.
  int num_crossed = 0;    ///< Borders crossed before it enters the current brick.
  int voxel = 0;          ///< Voxel where it enters the brick, mirrored: 0 to 7.
  int mirror = 0;         ///< 7 if coordinates are mirrored: 7 - i is i ^ 7.
  BrickKey key_step = 0;  ///< Key difference to the next brick.
  Lanes lane_offsets{};   ///< Change of the phase from the first slab to each.
  Lanes lane_slope{};     ///< Slope with 16 bits after the point.

  void setUpLanes() {
    constexpr Lanes kSlabs{0, 1, 2, 3, 4, 5, 6, 7};
    lane_offsets = kSlabs * static_cast<std::uint16_t>(slope >> (kPhaseBits - kLaneBits));
    constexpr std::int64_t kGreatest = 0xFFFF;
    lane_slope += static_cast<std::uint16_t>(std::min(slope >> (kPhaseBits - 16), kGreatest));
  }

  /// Whether rounding errors of the ray walk may let the beam cross two borders, or none, in a slab.
  [[nodiscard]] bool isDiagonal() const { return slope > (1LL << kPhaseBits) - 2 * kUnsure; }
  [[nodiscard]] double crossingOf(int border) const { return t_first + border * t_delta; }
  /// Phases at the far ends of the brick's slabs; up to 8 units too low.
  [[nodiscard]] Lanes lanePhases() const {
    return static_cast<std::uint16_t>(phase >> (kPhaseBits - kLaneBits)) + lane_offsets;
  }

  /// Slabs in which the beam crosses a border. @param slabs  Slabs whose phases are sure.
  [[nodiscard]] unsigned findCrossings(unsigned is_odd, unsigned slabs) const {
    const unsigned odd = is_odd & ~((slabs & -slabs) - 1U);
    return (odd ^ (odd << 1 | (static_cast<unsigned>(num_crossed) & 1U))) & slabs;
  }
};

/// Crossings by the phases at the far ends of eight slabs: bit i is for slab i.
struct SlabEnds {
  unsigned is_odd[2];     ///< The number of crossed borders is odd, of rows and of words.
  unsigned is_unsure;     ///< A border is so near that rounding may have moved it.
  unsigned is_row_first;  ///< Slabs in which borders of both axes are crossed.
  unsigned is_order_unsure;
};

inline SlabEnds computeSlabEnds(const CrossedAxis& row, const CrossedAxis& word) {
  const Lanes row_phases = row.lanePhases();
  const Lanes word_phases = word.lanePhases();
  // True phases are up to 8 units higher; one more on either side for rounding.
  constexpr std::uint16_t kBelow = 9;
  constexpr std::uint16_t kUnsureLanes = 2 * (kBelow + 1);
  const Lanes is_unsure = reinterpret_cast<Lanes>((row_phases + kBelow) << 1 <= kUnsureLanes) |
                          reinterpret_cast<Lanes>((word_phases + kBelow) << 1 <= kUnsureLanes);

  // The row's border lies before the word's if fraction / slope, the distance from there to the end of
  // the slab, is longer. The products are up to 21 units too low.
  constexpr std::uint16_t kOrderUnsure = 22;
  const Lanes row_way = multiplyHigh(row_phases << 1, word.lane_slope);
  const Lanes word_way = multiplyHigh(word_phases << 1, row.lane_slope);
  const Lanes is_row_first = reinterpret_cast<Lanes>(row_way > word_way);
  const Lanes distance = is_row_first ? row_way - word_way : word_way - row_way;
  const Lanes is_order_unsure = reinterpret_cast<Lanes>(distance <= kOrderUnsure) | is_unsure;

  const unsigned is_odd = highestBits(row_phases, word_phases);
  const unsigned order = highestBits(is_row_first, is_order_unsure);
  return {{is_odd & kAllSlabs, is_odd >> 8},
          highestBits(is_unsure, is_unsure) & kAllSlabs,
          order & kAllSlabs,
          order >> 8};
}

}  // namespace cuboid_mapping
