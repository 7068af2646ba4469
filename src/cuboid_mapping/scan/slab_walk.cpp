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

constexpr int kMaxSlabs = 30000;  ///< Counts of borders fit into a phase.
/// Share of a length that rounding errors of sums of up to 2^16 terms do not reach.
constexpr double kUnsureShare = 1.0 / (1ULL << 32);

constexpr std::uint64_t kFirstOfEachRow = 0x0101010101010101ULL;

constexpr std::array<std::uint8_t, 256> makeSlabCounts() {
  std::array<std::uint8_t, 256> counts{};
  for (unsigned slabs = 1; slabs < 256; ++slabs) {
    counts[slabs] = static_cast<std::uint8_t>(counts[slabs / 2] + slabs % 2);
  }
  return counts;
}

/// The instruction that counts bits is not there on every x86-64.
constexpr std::array<std::uint8_t, 256> kSlabCounts = makeSlabCounts();

int countSlabs(unsigned slabs) { return kSlabCounts[slabs]; }

/// A plane of a brick: row = voxel across the beam, column = slab. For every pattern of slabs in
/// which the beam crosses a border to the next row, from row 0.
struct RowTables {
  std::array<std::uint64_t, 256> entries{};  ///< The voxel where the beam enters each slab.
  std::array<std::uint64_t, 256> exits{};    ///< Where it leaves; row 8 is left out.
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

/// Where the rows of a brick's planes lie: one of RowTables, moved to the row of the beam.
struct PlaneRows {
  std::uint64_t entries;
  std::uint64_t exits;
  int shift;
  bool has_ninth;  ///< The beam crosses a border in each slab: row 8, which the tables leave out.
};

/// Walks along one beam from brick to brick; up the axis along which it is longest, whether that is
/// from the origin to the end or back.
class SlabWalk {
 public:
  SlabWalk(const Ray& ray, BeamMarks& beam_marks) : ray_(ray), beam_marks_(beam_marks) {}

  /// @return Whether the beam ends clearly between the borders that lead to its end.
  [[nodiscard]] bool begin(const Cell& local_start);
  /// @return false where walkRay() has to go on.
  [[nodiscard]] bool run();

 private:
  void beginAcross(AcrossAxis& across, int axis, const Cell& local_from);
  [[nodiscard]] double firstCrossing(int axis) const;
  [[nodiscard]] double exactCrossing(int axis, int border) const;
  [[nodiscard]] bool isBefore(const AcrossAxis& across, int border, int other_axis,
                              int other_border) const;
  [[nodiscard]] unsigned decide(const AcrossAxis& across, unsigned is_odd, unsigned unsure) const;
  [[nodiscard]] bool markBrick(unsigned slabs, int last_slab);
  [[nodiscard]] unsigned decideOrder(unsigned rows, unsigned words, unsigned is_row_first,
                                     unsigned unsure) const;
  void markPlane(const PlaneRows& rows, unsigned entered, unsigned left);
  [[nodiscard]] std::uint64_t* findMisses(BrickKey key) {
    return &beam_marks_.at(key).misses[static_cast<std::size_t>(along_)][0];
  }
  void stepToNextWord();

  const Ray& ray_;
  BeamMarks& beam_marks_;
  std::uint64_t* misses_ = nullptr;  ///< Of the brick `key_`.
  /// Of the next one across; nowhere_ when the beam does not get there.
  std::uint64_t* next_row_misses_ = nullptr;
  std::uint64_t nowhere_[8] = {};
  BrickKey key_ = 0;
  int along_ = 0;
  bool is_backward_ = false;  ///< From the end to the origin.
  double margin_ = 0.0;
  int num_borders_[3] = {0, 0, 0};
  int slab_ = 0;        ///< In the brick, where the beam enters it.
  int first_slab_ = 0;  ///< Of the brick, counted from that where the walk began.
  AcrossAxis row_;
  AcrossAxis word_;
};

double SlabWalk::firstCrossing(int axis) const {
  if (!is_backward_) return ray_.t_max[axis];
  return -(ray_.t_max[axis] + (num_borders_[axis] - 1) * ray_.t_delta[axis]);
}

bool SlabWalk::begin(const Cell& local_start) {
  margin_ = ray_.length_m * kUnsureShare;
  for (int axis = 0; axis < 3; ++axis) {
    num_borders_[axis] = std::abs(ray_.end[axis] - ray_.start[axis]);
    const double next = ray_.t_max[axis] + num_borders_[axis] * ray_.t_delta[axis];
    if (!(next > ray_.length_m + margin_)) return false;
    if (num_borders_[axis] == 0) continue;
    const double last = ray_.t_max[axis] + (num_borders_[axis] - 1) * ray_.t_delta[axis];
    if (!(last < ray_.length_m - margin_)) return false;
    if (ray_.t_delta[axis] < ray_.t_delta[along_]) along_ = axis;
  }
  if (num_borders_[along_] < 1 || num_borders_[along_] > kMaxSlabs) return false;

  is_backward_ = ray_.step[along_] < 0;
  const Cell local_from = is_backward_ ? local_start + (ray_.end - ray_.start) : local_start;
  key_ = toBrickKey(local_from);
  slab_ = local_from[along_] & 7;
  first_slab_ = -slab_;
  beginAcross(row_, along_ == 0 ? 1 : 0, local_from);
  beginAcross(word_, along_ == 2 ? 1 : 2, local_from);
  return true;
}

void SlabWalk::beginAcross(AcrossAxis& across, int axis, const Cell& local_from) {
  across.axis = axis;
  across.voxel = local_from[axis] & 7;
  across.num_borders = num_borders_[axis];
  if (across.num_borders == 0) return;
  across.mirror = (ray_.step[axis] < 0) != is_backward_ ? 7 : 0;
  across.voxel ^= across.mirror;
  const BrickKey up = BrickKey{1} << (kBrickKeyBits * axis);
  across.key_step = across.mirror != 0 ? -up : up;
  across.t_first = firstCrossing(axis);
  across.t_delta = ray_.t_delta[axis];
  constexpr double kUnit = 1LL << kPhaseBits;
  const double inverse_delta = 1.0 / across.t_delta;
  const double phase = (firstCrossing(along_) - across.t_first) * inverse_delta + 1.0;
  across.slope = static_cast<std::int64_t>(ray_.t_delta[along_] * inverse_delta * kUnit);
  across.phase = static_cast<std::int64_t>(phase * kUnit) - slab_ * across.slope;
  constexpr Lanes kSlabs{0, 1, 2, 3, 4, 5, 6, 7};
  across.lane_offsets =
      kSlabs * static_cast<std::uint16_t>(across.slope >> (kPhaseBits - kLaneBits));
  constexpr std::int64_t kGreatest = 0xFFFF;
  across.lane_slope +=
      static_cast<std::uint16_t>(std::min(across.slope >> (kPhaseBits - 16), kGreatest));
}

bool SlabWalk::run() {
  for (int last = slab_ + num_borders_[along_];; last -= 8) {
    unsigned slabs = kAllSlabs & kAllSlabs << slab_;
    if (last < 8) slabs &= (2U << last) - 1U;
    misses_ = findMisses(key_);
    if (!markBrick(slabs, last)) return false;
    if (last < 8) return true;
    slab_ = 0;
    first_slab_ += 8;
    key_ += BrickKey{1} << (kBrickKeyBits * along_);
  }
}

/// Where walkRay() crosses a border, to the last bit. @param border  In the order of the walk here.
double SlabWalk::exactCrossing(int axis, int border) const {
  const int additions = is_backward_ ? num_borders_[axis] - 1 - border : border;
  double t = ray_.t_max[axis];
  for (int i = 0; i < additions; ++i) t += ray_.t_delta[axis];
  return t;
}

/// Whether the beam crosses one border before another, in the order of the walk here. Ties as in
/// walkRay(): z before y before x.
bool SlabWalk::isBefore(const AcrossAxis& across, int border, int other_axis,
                        int other_border) const {
  const double t = exactCrossing(across.axis, border);
  const double other_t = exactCrossing(other_axis, other_border);
  const bool is_first = t != other_t ? t < other_t : across.axis > other_axis;
  return is_first != is_backward_;
}

/// Corrects what the phases say at the ends of some slabs. @return is_odd.
unsigned SlabWalk::decide(const AcrossAxis& across, unsigned is_odd, unsigned unsure) const {
  constexpr std::int64_t kHalf = 1LL << (kPhaseBits - 1);
  for (; unsure != 0; unsure &= unsure - 1) {
    const int slab = __builtin_ctz(unsure);
    const std::int64_t phase = across.phase + slab * across.slope;
    const std::int64_t border = (phase + kHalf) >> kPhaseBits;
    std::int64_t crossed = phase >> kPhaseBits;
    if (std::abs(phase - (border << kPhaseBits)) <= kUnsure) {
      crossed = std::min<std::int64_t>(std::max<std::int64_t>(border, 0), across.num_borders);
      if (crossed == border && border > 0 &&
          !isBefore(across, static_cast<int>(border) - 1, along_, first_slab_ + slab)) {
        --crossed;
      }
    }
    is_odd = (is_odd & ~(1U << slab)) | (static_cast<unsigned>(crossed) & 1U) << slab;
  }
  return is_odd;
}

/// Corrects which border comes first in some slabs where the beam crosses borders of both axes.
/// @return is_row_first.
unsigned SlabWalk::decideOrder(unsigned rows, unsigned words, unsigned is_row_first,
                               unsigned unsure) const {
  for (; unsure != 0; unsure &= unsure - 1) {
    const unsigned slab = unsure & -unsure;
    const int row_border = row_.num_crossed + countSlabs(rows & (slab - 1));
    const int word_border = word_.num_crossed + countSlabs(words & (slab - 1));
    const double gap = row_.crossingOf(row_border) - word_.crossingOf(word_border);
    const bool is_first =
        std::abs(gap) < margin_ ? isBefore(row_, row_border, word_.axis, word_border) : gap < 0.0;
    is_row_first = is_first ? is_row_first | slab : is_row_first & ~slab;
  }
  return is_row_first;
}

/// @param slabs  Of the brick that the beam passes.
/// @param last_slab  Of the beam; below 8 when it lies in this brick.
/// @return false, with nothing marked, when it cannot be told what the beam passes.
bool SlabWalk::markBrick(unsigned slabs, int last_slab) {
  SlabEnds ends = computeSlabEnds(row_, word_);
  const unsigned decided = last_slab < 8 ? slabs & ~(1U << last_slab) : slabs;
  if ((ends.is_unsure & decided) != 0) {
    if (row_.isDiagonal() || word_.isDiagonal()) return false;
    ends.is_odd[0] = decide(row_, ends.is_odd[0], ends.is_unsure & decided);
    ends.is_odd[1] = decide(word_, ends.is_odd[1], ends.is_unsure & decided);
  }
  unsigned rows = row_.findCrossings(ends.is_odd[0], decided);
  unsigned words = word_.findCrossings(ends.is_odd[1], decided);
  if (last_slab < 8) {
    // In its last slab the beam crosses what is left.
    const int rows_left = row_.num_borders - row_.num_crossed - countSlabs(rows);
    const int words_left = word_.num_borders - word_.num_crossed - countSlabs(words);
    assert((rows_left | words_left | 1) == 1);
    rows |= static_cast<unsigned>(rows_left) << last_slab;
    words |= static_cast<unsigned>(words_left) << last_slab;
  }
  unsigned is_row_first = ends.is_row_first & rows & words;
  const unsigned order_unsure = rows & words & ends.is_order_unsure;
  if (order_unsure != 0) is_row_first = decideOrder(rows, words, is_row_first, order_unsure);

  const int last_row = row_.voxel + countSlabs(rows);
  next_row_misses_ = last_row > 7 ? findMisses(key_ + row_.key_step) : nowhere_;
  const PlaneRows plane_rows{kRows.entries[rows], kRows.exits[rows], 8 * row_.voxel,
                             rows == kAllSlabs};
  // Plane by plane: slabs that the beam enters, and leaves, in the plane.
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

  row_.num_crossed += countSlabs(rows);
  word_.num_crossed += countSlabs(words);
  row_.phase += 8 * row_.slope;
  word_.phase += 8 * word_.slope;
  row_.voxel = last_row & 7;
  if (last_row > 7) key_ += row_.key_step;
  return true;
}

void SlabWalk::markPlane(const PlaneRows& rows, unsigned entered, unsigned left) {
  const std::uint64_t plane =
      (rows.entries & entered * kFirstOfEachRow) | (rows.exits & left * kFirstOfEachRow);
  const auto word = static_cast<std::size_t>(word_.voxel ^ word_.mirror);
  const std::uint64_t here = plane << rows.shift;
  misses_[word] |= row_.mirror != 0 ? __builtin_bswap64(here) : here;
  std::uint64_t beyond = plane >> 1 >> (63 - rows.shift);
  if (rows.has_ninth) beyond |= std::uint64_t{left & 0x80U} << rows.shift;
  next_row_misses_[word] |= row_.mirror != 0 ? __builtin_bswap64(beyond) : beyond;
}

void SlabWalk::stepToNextWord() {
  if (++word_.voxel < 8) return;
  word_.voxel = 0;
  key_ += word_.key_step;
  misses_ = findMisses(key_);
  if (next_row_misses_ != nowhere_) next_row_misses_ = findMisses(key_ + row_.key_step);
}

}  // namespace

bool markSlabs(const Ray& ray, const Cell& local_start, BeamMarks& marks) {
  SlabWalk walk(ray, marks);
  return walk.begin(local_start) && walk.run();
}

}  // namespace cuboid_mapping
