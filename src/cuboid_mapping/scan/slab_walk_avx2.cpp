// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/slab_walk_avx2.h"

#include "cuboid_mapping/scan/slab_beam.h"

#include <cstdint>

// Clang has no such switch of instructions within a file that its linters understand.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define CUBOID_MAPPING_HAS_AVX2 1
#include <immintrin.h>
#endif

namespace cuboid_mapping {

#ifdef CUBOID_MAPPING_HAS_AVX2

// What is included above keeps the instructions that every processor has.
#pragma GCC push_options
#pragma GCC target("avx2")

namespace {

/// Eight slabs.
///@{
using Lanes = std::int32_t __attribute__((vector_size(32)));
using Fractions = float __attribute__((vector_size(32)));
///@}
/// Four slabs, a mask for each.
using Masks = std::uint64_t __attribute__((vector_size(32)));

/// The phases of eight slabs have 5 bits before the point, one of them the sign, and 27 after it.
constexpr int kLaneBits = 27;
constexpr std::int32_t kFraction = (1 << kLaneBits) - 1;
/// Lanes are up to 8 units too low; one more for what rounding may do.
constexpr std::int32_t kBelow = static_cast<std::int32_t>(kUnsure >> (kPhaseBits - kLaneBits)) + 9;
/// Of the difference of two fractions times slopes. Lanes may be 9 units too low, rounding may move each by 32, and a
/// float holds 24 bits of them.
constexpr float kOrderUnsure = 128.0F;

constexpr Lanes kSlabs{0, 1, 2, 3, 4, 5, 6, 7};

/// Bits of a voxel's place that say that it is in the next brick along the rows, or along the words.
constexpr std::uint64_t kNextRow = 128;
constexpr std::uint64_t kNextWord = 64;

bool hasAny(const Lanes& lanes) {
  const auto bits = reinterpret_cast<__m256i>(lanes);
  return _mm256_testz_si256(bits, bits) == 0;
}

/// Bit `place` of each mask; none where it is 64 or greater.
Masks bitAt(const Masks& place) {
  return reinterpret_cast<Masks>(
      _mm256_sllv_epi64(_mm256_set1_epi64x(1), reinterpret_cast<__m256i>(place)));
}

/// An axis across the beam, on the way from brick to brick. Its phase counts from the brick's first
/// voxel, not from where the beam begins.
struct WideAxis {
  std::int64_t phase;
  std::int64_t slope;
  BrickKey key_step;
  int first;  ///< Voxel where the beam enters the brick: 0 to 7.
  int last;   ///< Voxel where the beam ends, counted from this brick's first.
  std::int32_t mirror;
  std::int32_t lane_slope;
  float order_slope;
  Lanes lane_offsets;

  explicit WideAxis(const AcrossAxis& across)
      : phase(across.phase + (std::int64_t{across.voxel} << kPhaseBits)),
        slope(across.slope),
        key_step(across.key_step),
        first(across.voxel),
        last(across.voxel + across.num_borders),
        mirror(across.mirror),
        lane_slope(static_cast<std::int32_t>(slope >> (kPhaseBits - kLaneBits))),
        order_slope(static_cast<float>(lane_slope) / (1 << kLaneBits)),
        lane_offsets(kSlabs * lane_slope) {}

  /// At the far ends of the brick's slabs.
  [[nodiscard]] Lanes phases() const {
    return static_cast<std::int32_t>(phase >> (kPhaseBits - kLaneBits)) + lane_offsets;
  }
  /// Voxel where the beam leaves the brick's last slab, or ends.
  [[nodiscard]] int leaves(bool is_last_brick) const {
    return is_last_brick ? last : static_cast<int>((phase + 7 * slope) >> kPhaseBits);
  }
  /// @param left  Voxel where the beam leaves the brick. @return Change of the brick's number.
  BrickKey advance(int left) {
    const int bricks = left >> 3;
    phase += 8 * slope - (std::int64_t{8 * bricks} << kPhaseBits);
    last -= 8 * bricks;
    first = left & 7;
    return bricks != 0 ? key_step : 0;
  }
};

/// Voxels that the beam passes in eight slabs: where it enters each, where it is between the borders
/// of both axes that it crosses, and where it leaves. They are the same without a border.
///
/// A voxel's place is the number of its bit in the mask of the slab, 8 * word + row, and kNextRow and
/// kNextWord. A place for each slab 0, 2, 4, 6, and 1, 3, 5, 7.
struct SlabPlaces {
  Masks even[3];
  Masks odd[3];

  void set(int i, const Lanes& places) {
    even[i] = reinterpret_cast<Masks>(places) & 0xFFFFFFFFU;
    odd[i] = reinterpret_cast<Masks>(places) >> 32;
  }
};

Lanes rowPlaces(const WideAxis& row, const Lanes& rows) {
  const Lanes next = rows & 8;
  return (rows + (next << 4) - next) ^ row.mirror;
}

Lanes wordPlaces(const WideAxis& word, const Lanes& words) { return words << 3 ^ word.mirror << 3; }

/// What the beam does on one axis across it, in eight slabs.
struct Crossings {
  Lanes entered;    ///< Voxel where it enters the slab.
  Lanes left;       ///< Where it leaves.
  Lanes fractions;  ///< How far it has come in that voxel at the far end of the slab.
  Lanes is_unsure;  ///< Rounding may have moved it across a border there.
};

/// @tparam kIsEnd  The beam begins in slab `first` of the brick, or ends in slab `last`, or both.
template <bool kIsEnd>
Crossings findCrossings(const WideAxis& axis, int first, int last) {
  const Lanes phases = axis.phases();
  Crossings crossings{(phases - axis.lane_slope) >> kLaneBits, phases >> kLaneBits,
                      phases & kFraction, ((phases + kBelow) & kFraction) <= 2 * kBelow};
  if (kIsEnd) {
    const Lanes is_last = kSlabs == last;
    crossings.entered = kSlabs == first ? Lanes{} + axis.first : crossings.entered;
    crossings.left = is_last ? Lanes{} + axis.last : crossings.left;
    crossings.fractions = phases - (crossings.left << kLaneBits);
    crossings.is_unsure &= ~is_last;
  } else {
    crossings.entered[0] = axis.first;
  }
  return crossings;
}

/// @tparam kIsEnd  As of findCrossings(). @return false when it cannot be told what the beam passes.
template <bool kIsEnd>
bool findPlaces(const WideAxis& row, const WideAxis& word, int first, int last,
                SlabPlaces& places) {
  const Crossings rows = findCrossings<kIsEnd>(row, first, last);
  const Crossings words = findCrossings<kIsEnd>(word, first, last);
  const Lanes is_outside = kIsEnd ? (kSlabs < first) | (kSlabs > last) : Lanes{};

  // The row's border lies before the word's when fraction / slope, the way from there to the end of
  // the slab, is longer.
  const Fractions row_way = __builtin_convertvector(rows.fractions, Fractions) * word.order_slope;
  const Fractions word_way = __builtin_convertvector(words.fractions, Fractions) * row.order_slope;
  const Fractions lead = row_way - word_way;
  const Lanes is_row_first = lead > 0.0F;
  const Lanes is_order_unsure = (lead < kOrderUnsure) & (lead > -kOrderUnsure);
  const Lanes is_unsure = rows.is_unsure | words.is_unsure;
  if (hasAny(is_unsure | is_order_unsure)) {
    const Lanes crosses_both = (rows.left > rows.entered) & (words.left > words.entered);
    if (hasAny((is_unsure | (is_order_unsure & crosses_both)) & ~is_outside)) return false;
  }

  const Lanes entered_rows = rowPlaces(row, rows.entered);
  const Lanes left_rows = rowPlaces(row, rows.left);
  const Lanes entered_words = wordPlaces(word, words.entered);
  const Lanes left_words = wordPlaces(word, words.left);
  const Lanes between =
      (is_row_first ? left_rows : entered_rows) | (is_row_first ? entered_words : left_words);
  // Outside, all bits of a place are set: in no brick.
  places.set(0, entered_rows | entered_words | is_outside);
  places.set(1, between | is_outside);
  places.set(2, left_rows | left_words | is_outside);
  return true;
}

/// Marks the places that lie in one brick. @param next  Bits of places there.
void markPlaces(const SlabPlaces& places, std::uint64_t next, BrickMask& slabs) {
  Masks even{};
  Masks odd{};
  for (int i = 0; i < 3; ++i) {
    even |= bitAt(places.even[i] ^ next);
    odd |= bitAt(places.odd[i] ^ next);
  }
  auto* masks = reinterpret_cast<__m256i*>(&slabs[0]);
  _mm256_store_si256(masks, _mm256_load_si256(masks) | reinterpret_cast<__m256i>(even));
  _mm256_store_si256(masks + 1, _mm256_load_si256(masks + 1) | reinterpret_cast<__m256i>(odd));
}

bool walkBricks(const SlabBeam<AcrossAxis>& beam, BeamMarks& marks) {
  WideAxis row(beam.row);
  WideAxis word(beam.word);
  BrickKey key = beam.key;
  const auto along = static_cast<std::size_t>(beam.along);
  int first = beam.slab;
  bool is_end = true;
  for (int last = first + beam.num_borders[beam.along];; last -= 8) {
    const bool is_last_brick = last < 8;
    is_end |= is_last_brick;
    SlabPlaces places;
    if (!(is_end ? findPlaces<true>(row, word, first, last, places)
                 : findPlaces<false>(row, word, first, last, places))) {
      return false;
    }
    const int left_row = row.leaves(is_last_brick);
    const int left_word = word.leaves(is_last_brick);
    markPlaces(places, 0, marks.at(key).slabs[along]);
    if (left_row > 7) markPlaces(places, kNextRow, marks.at(key + row.key_step).slabs[along]);
    if (left_word > 7) {
      markPlaces(places, kNextWord, marks.at(key + word.key_step).slabs[along]);
      if (left_row > 7) {
        markPlaces(places, kNextRow | kNextWord,
                   marks.at(key + row.key_step + word.key_step).slabs[along]);
      }
    }
    if (is_last_brick) return true;
    key += (BrickKey{1} << (kBrickKeyBits * beam.along)) + row.advance(left_row) +
           word.advance(left_word);
    first = 0;
    is_end = false;
  }
}

/// The axis whose border walkRay() crosses next, see there.
int nextAxis(const Ray& ray) {
  const int axis = ray.t_max[0] < ray.t_max[1] ? 0 : 1;
  return ray.t_max[axis] < ray.t_max[2] ? axis : 2;
}

/// Whether the origin lies on the border that the beam crosses first.
bool isOnBorder(const Ray& ray) {
  constexpr double kShare = 1e-6;
  const int axis = nextAxis(ray);
  return ray.t_max[axis] < kShare * ray.t_delta[axis];
}

bool markFromVoxel(const Ray& ray, const Cell& local_start, BeamMarks& marks) {
  SlabBeam<AcrossAxis> beam;
  return beam.setUp(ray, local_start) && walkBricks(beam, marks);
}

}  // namespace

bool markSlabsAvx2(const Ray& ray, const Cell& local_start, BeamMarks& marks) {
  if (!isOnBorder(ray)) return markFromVoxel(ray, local_start, marks);
  Ray rest = ray;
  Cell local = local_start;
  do {
    const int axis = nextAxis(rest);
    if (rest.start[axis] == rest.end[axis]) return false;
    marks.at(toBrickKey(local)).misses[0].set(voxelIndex(local));
    rest.start[axis] += rest.step[axis];
    local[axis] += rest.step[axis];
    rest.t_max[axis] += rest.t_delta[axis];
  } while (isOnBorder(rest));
  return markFromVoxel(rest, local, marks);
}

#pragma GCC pop_options

bool hasSlabWalkAvx2() {
  static const bool has_avx2 = __builtin_cpu_supports("avx2") != 0;
  return has_avx2;
}

#else

bool hasSlabWalkAvx2() { return false; }
bool markSlabsAvx2(const Ray&, const Cell&, BeamMarks&) { return false; }

#endif

}  // namespace cuboid_mapping
