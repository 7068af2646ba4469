// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/slab_walk.h"

#include "cuboid_mapping/scan/slab_crossings.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdlib>

namespace cuboid_mapping {
namespace {

constexpr std::uint64_t kFirstOfEachRow = 0x0101010101010101ULL;

constexpr std::array<std::uint8_t, 256> makeSlabCounts() {
  std::array<std::uint8_t, 256> counts{};
  for (unsigned slabs = 1; slabs < 256; ++slabs) {
    counts[slabs] = static_cast<std::uint8_t>(counts[slabs / 2] + slabs % 2);
  }
  return counts;
}

/// Numbers of bits: not every x86-64 has an instruction to count them.
constexpr std::array<std::uint8_t, 256> kSlabCounts = makeSlabCounts();

int countSlabs(unsigned slabs) { return kSlabCounts[slabs]; }

/// Voxels of a brick's plane (row = voxel across the beam, column = slab), for every pattern of slabs in
/// which the beam crosses a border to the next row, from row 0.
struct RowTables {
  std::array<std::uint64_t, 256> entries{};  ///< The voxel where the beam enters each slab.
  std::array<std::uint64_t, 256> exits{};    ///< Voxels where it leaves, without row 8.
};

constexpr RowTables makeRowTables() {
  RowTables tables;
  for (unsigned pattern = 0; pattern < 256; ++pattern) {
    unsigned row = 0;
    for (unsigned slab = 0; slab < 8; ++slab) {
      tables.entries[pattern] |= 1ULL << (8 * row + slab);
      row += pattern >> slab & 1U;
      if (row < 8) tables.exits[pattern] |= 1ULL << (8 * row + slab);
    }
  }
  return tables;
}

constexpr RowTables kRows = makeRowTables();

/// Rows of a brick's plane from RowTables, moved to the row of the beam.
struct PlaneRows {
  std::uint64_t entries;
  std::uint64_t exits;
  int shift;
  bool has_ninth;  ///< The beam crosses a border in each slab: row 8, which the tables leave out.
};

/// A beam, set up for a walk from slab to slab: up its longest axis, from the origin to the end
/// or back.
struct SlabBeam {
  int along = 0;             ///< The longest axis.
  bool is_backward = false;  ///< The walk goes from the end to the origin.
  double margin = 0.0;       ///< Lengths that differ by less may have another order in walkRay().
  int num_borders[3] = {0, 0, 0};
  BrickKey key = 0;  ///< Key of the brick where the walk begins.
  int slab = 0;      ///< Slab of that brick where the walk begins.
  CrossedAxis row;
  CrossedAxis word;

  /// @param local_start  ray.start minus the base of the brick numbers: each in [0, 2^24).
  /// @return false if the beam ends too near a border to decide whether it crosses it, or does not leave
  /// its first slab.
  [[nodiscard]] bool setUp(const Ray& ray, const Cell& local_start);

 private:
  void setUpAcross(CrossedAxis& across, const Ray& ray, int axis, const Cell& local_from) const;
  [[nodiscard]] double firstCrossing(const Ray& ray, int axis) const;
};

double SlabBeam::firstCrossing(const Ray& ray, int axis) const {
  if (!is_backward) return ray.t_max[axis];
  return -(ray.t_max[axis] + (num_borders[axis] - 1) * ray.t_delta[axis]);
}

void SlabBeam::setUpAcross(CrossedAxis& across, const Ray& ray, int axis,
                           const Cell& local_from) const {
  across.axis = axis;
  across.voxel = local_from[axis] & 7;
  across.num_borders = num_borders[axis];
  if (across.num_borders == 0) return;
  across.mirror = (ray.step[axis] < 0) != is_backward ? 7 : 0;
  across.voxel ^= across.mirror;
  const BrickKey up = BrickKey{1} << (kBrickKeyBits * axis);
  across.key_step = across.mirror != 0 ? -up : up;
  across.t_first = firstCrossing(ray, axis);
  across.t_delta = ray.t_delta[axis];
  constexpr double kUnit = 1LL << kPhaseBits;
  const double inverse_delta = 1.0 / across.t_delta;
  const double phase = (firstCrossing(ray, along) - across.t_first) * inverse_delta + 1.0;
  across.slope = static_cast<std::int64_t>(ray.t_delta[along] * inverse_delta * kUnit);
  across.phase = static_cast<std::int64_t>(phase * kUnit) - slab * across.slope;
}

bool SlabBeam::setUp(const Ray& ray, const Cell& local_start) {
  margin = ray.length_m * kUnsureShare;
  for (int axis = 0; axis < 3; ++axis) {
    num_borders[axis] = std::abs(ray.end[axis] - ray.start[axis]);
    const double next = ray.t_max[axis] + num_borders[axis] * ray.t_delta[axis];
    if (!(next > ray.length_m + margin)) return false;
    if (num_borders[axis] == 0) continue;
    const double last = ray.t_max[axis] + (num_borders[axis] - 1) * ray.t_delta[axis];
    if (!(last < ray.length_m - margin)) return false;
    if (ray.t_delta[axis] < ray.t_delta[along]) along = axis;
  }
  if (num_borders[along] < 1 || num_borders[along] > kMaxSlabs) return false;

  is_backward = ray.step[along] < 0;
  const Cell local_from = is_backward ? local_start + (ray.end - ray.start) : local_start;
  key = toBrickKey(local_from);
  slab = local_from[along] & 7;
  setUpAcross(row, ray, along == 0 ? 1 : 0, local_from);
  setUpAcross(word, ray, along == 2 ? 1 : 2, local_from);
  return true;
}

/// Walks along one beam from brick to brick.
class SlabWalk {
 public:
  SlabWalk(const Ray& ray, BeamMarks& beam_marks) : ray_(ray), beam_marks_(beam_marks) {}

  /// @return Whether the beam clearly ends between the last borders.
  [[nodiscard]] bool begin(const Cell& local_start);
  /// @return false if walkRay() has to go on.
  [[nodiscard]] bool run();

 private:
  [[nodiscard]] double exactCrossing(int axis, int border) const;
  [[nodiscard]] bool isBefore(const CrossedAxis& across, int border, int other_axis,
                              int other_border) const;
  [[nodiscard]] unsigned decide(const CrossedAxis& across, unsigned is_odd, unsigned unsure) const;
  [[nodiscard]] bool markBrick(unsigned slabs, int last_slab);
  [[nodiscard]] unsigned decideOrder(unsigned rows, unsigned words, unsigned is_row_first,
                                     unsigned unsure) const;
  void markPlane(const PlaneRows& rows, unsigned entered, unsigned left);
  [[nodiscard]] std::uint64_t* findMisses(BrickKey key) {
    return &beam_marks_.findOrAdd(key).misses[static_cast<std::size_t>(beam_.along)][0];
  }
  void stepToNextWord();

  const Ray& ray_;
  BeamMarks& beam_marks_;
  std::uint64_t* misses_ = nullptr;  ///< Misses of the brick `beam_.key`.
  /// Misses of the next brick across; nowhere_ if the beam does not reach it.
  std::uint64_t* next_row_misses_ = nullptr;
  std::uint64_t nowhere_[8] = {};
  SlabBeam beam_;
  int first_slab_ = 0;  ///< First slab of the brick, counted from the first brick of the walk.
};

bool SlabWalk::begin(const Cell& local_start) {
  if (!beam_.setUp(ray_, local_start)) return false;
  beam_.row.setUpLanes();
  beam_.word.setUpLanes();
  first_slab_ = -beam_.slab;
  return true;
}

bool SlabWalk::run() {
  for (int last = beam_.slab + beam_.num_borders[beam_.along];; last -= 8) {
    unsigned slabs = kAllSlabs & kAllSlabs << beam_.slab;
    if (last < 8) slabs &= (2U << last) - 1U;
    misses_ = findMisses(beam_.key);
    if (!markBrick(slabs, last)) return false;
    if (last < 8) return true;
    beam_.slab = 0;
    first_slab_ += 8;
    beam_.key += BrickKey{1} << (kBrickKeyBits * beam_.along);
  }
}

/// Length at which walkRay() crosses a border, to the last bit. @param border  Number in the order of this walk.
double SlabWalk::exactCrossing(int axis, int border) const {
  const int additions = beam_.is_backward ? beam_.num_borders[axis] - 1 - border : border;
  double t = ray_.t_max[axis];
  for (int i = 0; i < additions; ++i) t += ray_.t_delta[axis];
  return t;
}

/// Whether the beam crosses one border before another, in the order of this walk. Ties as in
/// walkRay(): z before y before x.
bool SlabWalk::isBefore(const CrossedAxis& across, int border, int other_axis,
                        int other_border) const {
  const double t = exactCrossing(across.axis, border);
  const double other_t = exactCrossing(other_axis, other_border);
  const bool is_first = t != other_t ? t < other_t : across.axis > other_axis;
  return is_first != beam_.is_backward;
}

/// Corrects the unsure phases at the ends of slabs. @return is_odd.
unsigned SlabWalk::decide(const CrossedAxis& across, unsigned is_odd, unsigned unsure) const {
  constexpr std::int64_t kHalf = 1LL << (kPhaseBits - 1);
  for (; unsure != 0; unsure &= unsure - 1) {
    const int slab = __builtin_ctz(unsure);
    const std::int64_t phase = across.phase + slab * across.slope;
    const std::int64_t border = (phase + kHalf) >> kPhaseBits;
    std::int64_t crossed = phase >> kPhaseBits;
    if (std::abs(phase - (border << kPhaseBits)) <= kUnsure) {
      crossed = std::min<std::int64_t>(std::max<std::int64_t>(border, 0), across.num_borders);
      if (crossed == border && border > 0 &&
          !isBefore(across, static_cast<int>(border) - 1, beam_.along, first_slab_ + slab)) {
        --crossed;
      }
    }
    is_odd = (is_odd & ~(1U << slab)) | (static_cast<unsigned>(crossed) & 1U) << slab;
  }
  return is_odd;
}

/// Corrects the unsure order of borders in slabs where the beam crosses borders of both axes.
/// @return is_row_first.
unsigned SlabWalk::decideOrder(unsigned rows, unsigned words, unsigned is_row_first,
                               unsigned unsure) const {
  for (; unsure != 0; unsure &= unsure - 1) {
    const unsigned slab = unsure & -unsure;
    const int row_border = beam_.row.num_crossed + countSlabs(rows & (slab - 1));
    const int word_border = beam_.word.num_crossed + countSlabs(words & (slab - 1));
    const double gap = beam_.row.crossingOf(row_border) - beam_.word.crossingOf(word_border);
    const bool is_first = std::abs(gap) < beam_.margin
                              ? isBefore(beam_.row, row_border, beam_.word.axis, word_border)
                              : gap < 0.0;
    is_row_first = is_first ? is_row_first | slab : is_row_first & ~slab;
  }
  return is_row_first;
}

/// @param slabs  Slabs of the brick that the beam passes.
/// @param last_slab  Last slab of the beam; below 8 if it lies in this brick.
/// @return false, with nothing marked, if the passed voxels cannot be decided.
bool SlabWalk::markBrick(unsigned slabs, int last_slab) {
  SlabEnds ends = computeSlabEnds(beam_.row, beam_.word);
  const unsigned decided = last_slab < 8 ? slabs & ~(1U << last_slab) : slabs;
  if ((ends.is_unsure & decided) != 0) {
    if (beam_.row.isDiagonal() || beam_.word.isDiagonal()) return false;
    ends.is_odd[0] = decide(beam_.row, ends.is_odd[0], ends.is_unsure & decided);
    ends.is_odd[1] = decide(beam_.word, ends.is_odd[1], ends.is_unsure & decided);
  }
  unsigned rows = beam_.row.findCrossings(ends.is_odd[0], decided);
  unsigned words = beam_.word.findCrossings(ends.is_odd[1], decided);
  if (last_slab < 8) {
    // In its last slab the beam crosses the remaining borders.
    const int rows_left = beam_.row.num_borders - beam_.row.num_crossed - countSlabs(rows);
    const int words_left = beam_.word.num_borders - beam_.word.num_crossed - countSlabs(words);
    assert((rows_left | words_left | 1) == 1);
    rows |= static_cast<unsigned>(rows_left) << last_slab;
    words |= static_cast<unsigned>(words_left) << last_slab;
  }
  unsigned is_row_first = ends.is_row_first & rows & words;
  const unsigned order_unsure = rows & words & ends.is_order_unsure;
  if (order_unsure != 0) is_row_first = decideOrder(rows, words, is_row_first, order_unsure);

  const int last_row = beam_.row.voxel + countSlabs(rows);
  next_row_misses_ = last_row > 7 ? findMisses(beam_.key + beam_.row.key_step) : nowhere_;
  const PlaneRows plane_rows{kRows.entries[rows], kRows.exits[rows], 8 * beam_.row.voxel,
                             rows == kAllSlabs};
  // For each plane: slabs that the beam enters, and leaves, in the plane.
  unsigned entered = slabs;
  unsigned left = slabs;
  for (unsigned crossings = words; crossings != 0; crossings &= crossings - 1) {
    const unsigned slab = crossings & -crossings;
    const unsigned before = slab - 1;
    markPlane(plane_rows, entered & (slab | before), (left & before) | (is_row_first & slab));
    entered = (entered & ~(slab | before)) | (rows & ~is_row_first & slab);
    left &= ~before;
    stepToNextWord();
  }
  markPlane(plane_rows, entered, left);

  beam_.row.num_crossed += countSlabs(rows);
  beam_.word.num_crossed += countSlabs(words);
  beam_.row.phase += 8 * beam_.row.slope;
  beam_.word.phase += 8 * beam_.word.slope;
  beam_.row.voxel = last_row & 7;
  if (last_row > 7) beam_.key += beam_.row.key_step;
  return true;
}

void SlabWalk::markPlane(const PlaneRows& rows, unsigned entered, unsigned left) {
  const std::uint64_t plane =
      (rows.entries & entered * kFirstOfEachRow) | (rows.exits & left * kFirstOfEachRow);
  const auto word = static_cast<std::size_t>(beam_.word.voxel ^ beam_.word.mirror);
  const std::uint64_t here = plane << rows.shift;
  misses_[word] |= beam_.row.mirror != 0 ? __builtin_bswap64(here) : here;
  std::uint64_t beyond = plane >> 1 >> (63 - rows.shift);
  if (rows.has_ninth) beyond |= std::uint64_t{left & 0x80U} << rows.shift;
  next_row_misses_[word] |= beam_.row.mirror != 0 ? __builtin_bswap64(beyond) : beyond;
}

void SlabWalk::stepToNextWord() {
  if (++beam_.word.voxel < 8) return;
  beam_.word.voxel = 0;
  beam_.key += beam_.word.key_step;
  misses_ = findMisses(beam_.key);
  if (next_row_misses_ != nowhere_) next_row_misses_ = findMisses(beam_.key + beam_.row.key_step);
}

}  // namespace

bool markSlabs(const Ray& ray, const Cell& local_start, BeamMarks& marks) {
  SlabWalk walk(ray, marks);
  return walk.begin(local_start) && walk.run();
}

}  // namespace cuboid_mapping
