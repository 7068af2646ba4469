// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/slab_walk.h"

#include "cuboid_mapping/scan/lanes.h"
#include "cuboid_mapping/scan/slab_beams.h"

#include <algorithm>

namespace cuboid_mapping {

#ifdef CUBOID_MAPPING_HAS_LANES

// Headers included above must use only the instructions that every processor has.
CUBOID_MAPPING_BEGIN_LANES

namespace {

using namespace lanes;

/// Bits after the point in the phases of eight slabs, with 5 bits before it, one of them the sign.
constexpr int kLaneBits = 27;
constexpr std::int32_t kFraction = (1 << kLaneBits) - 1;
/// Error of lanes: up to 8 units too low, and one more for rounding.
constexpr std::int32_t kBelow = static_cast<std::int32_t>(kUnsure >> (kPhaseBits - kLaneBits)) + 9;
/// Largest error of the difference of two fractions times slopes. Lanes may be 9 units too low, rounding may
/// move each by 32, and a float holds 24 bits of them.
constexpr float kOrderUnsure = 128.0F;

/// The slab of each lane: the lower halves of 64 bits have slabs 0 to 3.
alignas(32) constexpr std::int32_t kSlabOrder[] = {0, 4, 1, 5, 2, 6, 3, 7};

Lanes slabs() { return load<Lanes>(kSlabOrder); }

/// Bits of a voxel's place for the next brick along the rows, and along the words.
constexpr std::int32_t kNextRow = 128;
constexpr std::int32_t kNextWord = 64;

BrickKey keyUp(std::size_t axis) { return BrickKey{1} << (kBrickKeyBits * static_cast<int>(axis)); }

/// An axis across the beam, on the walk from brick to brick. Its phase counts from the brick's first
/// voxel, not from the start of the beam.
struct WideAxis {
  std::int64_t phase;
  std::int64_t slope;
  BrickKey key_step;
  int first;  ///< Voxel where the beam enters the brick: 0 to 7.
  int last;   ///< Voxel where the beam ends, counted from this brick's first.
  std::int32_t lane_slope;
  float order_slope;
  Lanes lane_offsets;

  WideAxis(const AcrossAxes& beams, std::size_t beam, int slab, BrickKey key_up)
      : slope(static_cast<std::int64_t>(beams.slopes[beam])),
        first(static_cast<int>(beams.voxels[beam])),
        last(first + static_cast<int>(beams.num_borders[beam])) {
    phase = static_cast<std::int64_t>(beams.phases[beam]) - slab * slope +
            (std::int64_t{first} << kPhaseBits);
    key_step = beams.mirrors[beam] != 0 ? -key_up : key_up;
    lane_slope = static_cast<std::int32_t>(slope >> (kPhaseBits - kLaneBits));
    order_slope = static_cast<float>(lane_slope) / (1 << kLaneBits);
    lane_offsets = slabs() * lane_slope;
  }

  /// Phases at the far ends of the brick's slabs.
  [[nodiscard]] Lanes phases() const {
    return static_cast<std::int32_t>(phase >> (kPhaseBits - kLaneBits)) + lane_offsets;
  }
  /// Voxel where the beam leaves the brick's last slab, or ends.
  [[nodiscard]] int leaves(bool is_last_brick) const {
    return is_last_brick ? last : static_cast<int>((phase + 7 * slope) >> kPhaseBits);
  }
  /// Whether rounding may decide in which brick the beam is after some bricks.
  [[nodiscard]] bool isUnsureAfter(int num_bricks) const {
    const std::int64_t fraction =
        (phase + (8 * num_bricks - 1) * slope) & ((1LL << kPhaseBits) - 1);
    return fraction < kUnsure || fraction > (1LL << kPhaseBits) - kUnsure;
  }
  /// Leaves out bricks from the one where the walk begins. @return Change of the brick's number.
  BrickKey skip(int num_bricks) {
    const auto left = static_cast<int>((phase + (8 * num_bricks - 1) * slope) >> kPhaseBits);
    const int bricks = left >> 3;
    phase += 8 * num_bricks * slope - (std::int64_t{8 * bricks} << kPhaseBits);
    last -= 8 * bricks;
    first = left & 7;
    return key_step * static_cast<BrickKey>(bricks);
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

/// Voxels that the beam passes in eight slabs: where it enters each, where it is between crossings of
/// both axes, and where it leaves. They are equal without a crossing.
///
/// A voxel's place is the index of its bit in the mask of the slab, 8 * word + row, plus kNextRow and
/// kNextWord.
struct SlabPlaces {
  Masks low[3];   ///< Slabs 0 to 3.
  Masks high[3];  ///< Slabs 4 to 7.

  void set(int i, const Lanes& places) {
    low[i] = as<Masks>(places) & 0xFFFFFFFFU;
    high[i] = as<Masks>(places) >> 32;
  }
  /// Those of some slabs.
  [[nodiscard]] SlabPlaces where(const Lanes& are_in) const {
    SlabPlaces out;
    out.set(0, ~are_in);
    SlabPlaces places;
    for (int i = 0; i < 3; ++i) {
      places.low[i] = low[i] | out.low[0];
      places.high[i] = high[i] | out.high[0];
    }
    return places;
  }
};

/// @param rows  Rows 0 to 15. @return Their bits in places, not mirrored: bit 3, for the next brick, goes to
///              kNextRow.
Lanes rowPlaces(const Lanes& rows) { return (rows | rows << 4) & (7 | kNextRow); }

/// The same of words, whose bit 3 goes to kNextWord.
Lanes wordPlaces(const Lanes& words) { return words << 3; }

/// Movement of the beam on one axis across it, in eight slabs.
struct Crossings {
  Lanes phases;     ///< Phases at the far ends of the slabs.
  Lanes entered;    ///< Voxels where it enters the slabs.
  Lanes left;       ///< Voxel where it leaves.
  Lanes fractions;  ///< Its position in that voxel at the far ends of the slabs.
};

/// @tparam IsEnd  The beam begins in slab `first` of the brick, or ends in slab `last`, or both.
template <bool IsEnd>
Crossings findCrossings(const WideAxis& axis, int first, int last) {
  const Lanes phases = axis.phases();
  Crossings crossings{phases, (phases - axis.lane_slope) >> kLaneBits, phases >> kLaneBits,
                      phases & kFraction};
  if (IsEnd) {
    crossings.entered = select(slabs() == first, Lanes{} + axis.first, crossings.entered);
    crossings.left = select(slabs() == last, Lanes{} + axis.last, crossings.left);
    crossings.fractions = phases - (crossings.left << kLaneBits);
  }
  return crossings;
}

/// Whether rounding may have moved the end of a slab across a border of either axis.
Lanes isUnsure(const Lanes& row_phases, const Lanes& word_phases) {
  // From a distance of kBelow below a border to as much above, the shifted and raised value is small.
  constexpr std::uint32_t kLimit = kBelow << (32 - kLaneBits);
  const Unsigned row_distance = (as<Unsigned>(row_phases) << (32 - kLaneBits)) + kLimit;
  const Unsigned word_distance = (as<Unsigned>(word_phases) << (32 - kLaneBits)) + kLimit;
  const Unsigned nearest = select(row_distance < word_distance, row_distance, word_distance);
  return nearest <= 2 * kLimit;
}

/// @tparam IsEnd  As for findCrossings(). @param mirrors  Bits that mirror a place.
/// @return false if the passed voxels cannot be decided.
template <bool IsEnd>
bool findPlaces(const WideAxis& row, const WideAxis& word, const Lanes& mirrors, int first,
                int last, SlabPlaces& places) {
  const Crossings rows = findCrossings<IsEnd>(row, first, last);
  const Crossings words = findCrossings<IsEnd>(word, first, last);
  const Lanes is_outside = IsEnd ? (slabs() < first) | (slabs() > last) : Lanes{};

  // The row's border lies before the word's if fraction / slope, the distance from there to the end of
  // the slab, is longer.
  const Fractions row_way = convert<Fractions>(rows.fractions) * word.order_slope;
  const Fractions word_way = convert<Fractions>(words.fractions) * row.order_slope;
  const Fractions lead = row_way - word_way;
  const Lanes is_row_first = lead > 0.0F;
  const auto lead_size = as<Fractions>(as<Lanes>(lead) & 0x7FFFFFFF);
  const Lanes is_order_unsure = lead_size < kOrderUnsure;
  Lanes is_unsure = isUnsure(rows.phases, words.phases);
  if (hasAny(is_unsure | is_order_unsure)) {
    if (IsEnd) is_unsure &= slabs() != last;
    const Lanes crosses_both = (rows.left > rows.entered) & (words.left > words.entered);
    const Lanes is_undecided = (is_unsure | (is_order_unsure & crosses_both)) & ~is_outside;
    if (hasAny(is_undecided)) return false;
  }

  const Lanes entered_row = rowPlaces(rows.entered);
  const Lanes left_row = rowPlaces(rows.left);
  const Lanes entered_word = wordPlaces(words.entered);
  const Lanes left_word = wordPlaces(words.left);
  const Lanes between =
      select(is_row_first, left_row, entered_row) | select(is_row_first, entered_word, left_word);
  // Outside, all bits of a place are set, which is in no brick.
  places.set(0, ((entered_row | entered_word) ^ mirrors) | is_outside);
  places.set(1, (between ^ mirrors) | is_outside);
  places.set(2, ((left_row | left_word) ^ mirrors) | is_outside);
  return true;
}

/// Marks places in one brick. @param next  Bits of its places.
void markPlaces(const SlabPlaces& places, std::int32_t next, BrickMask& slabs) {
  Masks low{};
  Masks high{};
  for (int i = 0; i < 3; ++i) {
    low |= bitAt(places.low[i] ^ next);
    high |= bitAt(places.high[i] ^ next);
  }
  store(load<Masks>(&slabs[0]) | low, &slabs[0]);
  store(load<Masks>(&slabs[4]) | high, &slabs[4]);
}

/// The bricks that a beam passes in eight slabs, where it leaves the first on an axis across, or on both.
struct PassedBricks {
  BrickKey key;
  BrickKey row_step;  ///< 0: it does not leave the brick.
  BrickKey word_step;
  std::size_t mask;  ///< See BrickMarks::misses.

  void mark(const SlabPlaces& places, BeamMarks& marks) const {
    markPlaces(places, 0, marks.findOrAdd(key).misses[mask]);
    if (row_step != 0) markPlaces(places, kNextRow, marks.findOrAdd(key + row_step).misses[mask]);
    if (word_step == 0) return;
    markPlaces(places, kNextWord, marks.findOrAdd(key + word_step).misses[mask]);
    if (row_step == 0) return;
    markPlaces(places, kNextRow | kNextWord,
               marks.findOrAdd(key + row_step + word_step).misses[mask]);
  }
};

/// Where a walk's marks go, by slabs counted from those of the current brick.
struct SlabMarks {
  BeamMarks* below;  ///< Those of slabs before `border`.
  BeamMarks* above;
  int border;
};
constexpr int kNoMargin = 1 << 30;

SlabMarks divideSlabs(const RayBatch& rays, const SlabBeams& beams, std::size_t beam,
                      const MarginSlabs& margin, BeamMarks& misses, BeamMarks& grazes) {
  const bool is_backward = beams.backward[beam] != 0;
  const std::int32_t begin = (is_backward ? rays.end : rays.start)[margin.axis][beam];
  const int border = static_cast<int>(beams.slabs[beam]) + margin.first - begin;
  if (is_backward) return {&grazes, &misses, border + 1};
  return {&misses, &grazes, border};
}

/// @param num_done  As for markSlabs(). @param marks  Where misses and grazes go.
bool walkBricks(const SlabBeams& beams, std::size_t beam, SlabMarks marks, int num_done) {
  const auto along = static_cast<std::size_t>(beams.along[beam]);
  const std::size_t mask = 2 - along;  // See BrickMarks::misses.
  int first = static_cast<int>(beams.slabs[beam]);
  WideAxis row(beams.row, beam, first, keyUp(along == 0 ? 1 : 0));
  WideAxis word(beams.word, beam, first, keyUp(along == 2 ? 1 : 2));
  const Lanes mirrors =
      Lanes{} + static_cast<std::int32_t>(beams.row.mirrors[beam] | beams.word.mirrors[beam] << 3);
  auto key = static_cast<BrickKey>(beams.keys[beam]);
  bool is_end = true;
  int last = first + static_cast<int>(beams.num_borders[beam]);
  // A step off a border may have taken a slab, and the longest of equal axes may be another one.
  const int num_sure = std::max(num_done - 2, 0);
  const bool is_backward = beams.backward[beam] != 0;
  const int num_skipped = is_backward ? 0 : std::min(first + num_sure, last) >> 3;
  if (num_skipped > 0) {
    if (row.isUnsureAfter(num_skipped) || word.isUnsureAfter(num_skipped)) return false;
    key += keyUp(along) * static_cast<BrickKey>(num_skipped) + row.skip(num_skipped) +
           word.skip(num_skipped);
    last -= 8 * num_skipped;
    marks.border -= 8 * num_skipped;
    first = 0;
    is_end = false;
  }
  for (;; last -= 8, marks.border -= 8) {
    if (is_backward && last < num_sure) return true;
    const bool is_last_brick = last < 8;
    is_end |= is_last_brick;
    SlabPlaces places;
    if (!(is_end ? findPlaces<true>(row, word, mirrors, first, last, places)
                 : findPlaces<false>(row, word, mirrors, first, last, places))) {
      return false;
    }
    const int left_row = row.leaves(is_last_brick);
    const int left_word = word.leaves(is_last_brick);
    const PassedBricks bricks{key, left_row > 7 ? row.key_step : 0,
                              left_word > 7 ? word.key_step : 0, mask};
    if (marks.border <= 0 || marks.border > 7) {
      bricks.mark(places, *(marks.border > 0 ? marks.below : marks.above));
    } else {
      const Lanes is_below = slabs() < marks.border;
      bricks.mark(places.where(is_below), *marks.below);
      bricks.mark(places.where(~is_below), *marks.above);
    }
    if (is_last_brick) return true;
    key += keyUp(along) + row.advance(left_row) + word.advance(left_word);
    first = 0;
    is_end = false;
  }
}

/// The axis whose border walkRay() crosses next.
int nextAxis(const RayBatch& rays, std::size_t ray) {
  const int axis = rays.t_max[0][ray] < rays.t_max[1][ray] ? 0 : 1;
  return rays.t_max[axis][ray] < rays.t_max[2][ray] ? axis : 2;
}

/// Share of the distance between borders that counts as zero.
constexpr double kBorderShare = 1e-6;

/// Whether the origin may lie on the border that the beam crosses first; for four beams.
Longs mayBeOnBorder(const RayBatch& rays, int first) {
  Longs may_be{};
  for (int axis = 0; axis < 3; ++axis) {
    const auto t_max = load<Doubles>(&rays.t_max[axis][first]);
    may_be |= t_max < kBorderShare * load<Doubles>(&rays.t_delta[axis][first]);
  }
  return may_be;
}

/// Takes walkRay()'s first steps while the origin lies on borders.
/// @return false if the beam ends there.
bool stepOffBorders(RayBatch& rays, std::size_t ray, const Cell& base, BeamMarks& marks) {
  for (int axis = nextAxis(rays, ray);
       rays.t_max[axis][ray] < kBorderShare * rays.t_delta[axis][ray]; axis = nextAxis(rays, ray)) {
    std::int32_t& start = rays.start[axis][ray];
    if (start == rays.end[axis][ray]) return false;
    const Cell local = rays.startOf(ray) - base;
    marks.findOrAdd(toBrickKey(local)).misses[0].set(voxelIndex(local));
    start += start < rays.end[axis][ray] ? 1 : -1;
    rays.t_max[axis][ray] += rays.t_delta[axis][ray];
  }
  return true;
}

}  // namespace

std::uint32_t markSlabs(RayBatch& rays, const Cell& base, BeamMarks& marks, int num_done,
                        const BatchMargins* margins) {
  std::uint32_t left = rays.taken;
  for (int first = 0; first < rays.count; first += 4) {
    std::uint32_t bits = toBits(mayBeOnBorder(rays, first)) << first & rays.taken;
    for (; bits != 0; bits &= bits - 1) {
      const auto ray = static_cast<std::size_t>(__builtin_ctz(bits));
      const MarginSlabs margin = margins == nullptr ? MarginSlabs() : margins->slabs[ray];
      const bool is_all_margin = margin.axis >= 0 && margin.first == rays.start[margin.axis][ray];
      BeamMarks& first_marks = is_all_margin ? margins->grazes : marks;
      if (!stepOffBorders(rays, ray, base, first_marks)) left &= ~(1U << ray);
    }
  }
  SlabBeams beams;
  const std::uint32_t set_up = setUpSlabBeams(rays, base, beams);
  std::uint32_t marked = 0;
  for (std::uint32_t bits = set_up & left; bits != 0; bits &= bits - 1) {
    const auto beam = static_cast<std::size_t>(__builtin_ctz(bits));
    SlabMarks slab_marks{&marks, &marks, kNoMargin};
    if (margins != nullptr && margins->slabs[beam].axis >= 0) {
      const MarginSlabs& margin = margins->slabs[beam];
      if (margin.axis != beams.along[beam]) continue;
      slab_marks = divideSlabs(rays, beams, beam, margin, marks, margins->grazes);
    }
    if (walkBricks(beams, beam, slab_marks, num_done)) marked |= 1U << beam;
  }
  return marked;
}

CUBOID_MAPPING_END_LANES

#else

std::uint32_t markSlabs(RayBatch&, const Cell&, BeamMarks&, int, const BatchMargins*) { return 0; }

#endif

}  // namespace cuboid_mapping
