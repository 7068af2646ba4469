// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/slab_beams.h"

#include "cuboid_mapping/scan/beam_marks.h"
#include "cuboid_mapping/scan/lanes.h"

#ifdef CUBOID_MAPPING_HAS_LANES

// Headers included above must use only the instructions that every processor has.
CUBOID_MAPPING_BEGIN_LANES

namespace cuboid_mapping {
namespace {

using namespace lanes;

/// Four beams on one axis.
struct AxisOfBeams {
  Doubles t_first;  ///< Lengths at the first border, as in Ray.
  Doubles t_last;   ///< Lengths at the last border, if there is one.
  Doubles t_delta;
  Doubles num_borders;
  Longs is_down;  ///< Mask of beams that go down.
  Longs start;    ///< Local cells.
  Longs end;

  AxisOfBeams(const RayBatch& rays, const Cell& base, int axis, int first)
      : t_first(load<Doubles>(&rays.t_max[axis][first])),
        t_delta(load<Doubles>(&rays.t_delta[axis][first])) {
    const Ints start_cell = load<Ints>(&rays.start[axis][first]);
    const Ints end_cell = load<Ints>(&rays.end[axis][first]);
    const Ints way = end_cell - start_cell;
    num_borders = __builtin_convertvector(way < 0 ? -way : way, Doubles);
    is_down = __builtin_convertvector(way < 0, Longs);
    start = __builtin_convertvector(start_cell - base[axis], Longs);
    end = __builtin_convertvector(end_cell - base[axis], Longs);
    t_last = t_first + (num_borders - 1.0) * t_delta;
  }

  /// Whether the beams cross these borders and no other, whatever the rounding.
  [[nodiscard]] Longs isClear(const Doubles& length) const {
    const Doubles margin = length * kUnsureShare;
    const Doubles t_next = t_first + num_borders * t_delta;
    return (t_next > length + margin) & ((num_borders == 0.0) | (t_last < length - margin));
  }
  [[nodiscard]] Doubles firstCrossing(const Longs& is_backward) const {
    return is_backward ? -t_last : t_first;
  }
  [[nodiscard]] Longs from(const Longs& is_backward) const { return is_backward ? end : start; }
};

/// Selects one axis or the other for each beam.
AxisOfBeams pick(const Longs& which, const AxisOfBeams& a, const AxisOfBeams& b) {
  AxisOfBeams selected = b;
  selected.t_first = which ? a.t_first : b.t_first;
  selected.t_last = which ? a.t_last : b.t_last;
  selected.t_delta = which ? a.t_delta : b.t_delta;
  selected.num_borders = which ? a.num_borders : b.num_borders;
  selected.is_down = which ? a.is_down : b.is_down;
  selected.start = which ? a.start : b.start;
  selected.end = which ? a.end : b.end;
  return selected;
}

/// Sets up an axis across four beams. Coordinates are mirrored where the beam goes down the axis on its walk.
void setUpAcross(const AxisOfBeams& across, const AxisOfBeams& along, const Longs& is_backward,
                 int first, AcrossAxes& beams) {
  constexpr double kUnit = 1LL << kPhaseBits;
  const Longs crosses = across.num_borders > 0.0;
  const Longs mirror = crosses & (across.is_down ^ is_backward) & 7;
  const Doubles inverse_delta = 1.0 / across.t_delta;
  const Doubles way = along.firstCrossing(is_backward) - across.firstCrossing(is_backward);
  const Doubles phase = way * inverse_delta + 1.0;
  const Doubles slope = along.t_delta * inverse_delta;
  store(crosses ? phase * kUnit : Doubles{} + kUnit / 2, &beams.phases[first]);
  store(crosses ? slope * kUnit : Doubles{}, &beams.slopes[first]);
  store((across.from(is_backward) & 7) ^ mirror, &beams.voxels[first]);
  store(across.num_borders, &beams.num_borders[first]);
  store(mirror, &beams.mirrors[first]);
}

/// Sets up four beams. @return Beams that are set up.
Longs setUp(const RayBatch& rays, const Cell& base, int first, SlabBeams& beams) {
  const AxisOfBeams x(rays, base, 0, first);
  const AxisOfBeams y(rays, base, 1, first);
  const AxisOfBeams z(rays, base, 2, first);
  const Longs is_y = (y.num_borders > 0.0) & (y.t_delta < x.t_delta);
  const AxisOfBeams longer = pick(is_y, y, x);
  const Longs is_z = (z.num_borders > 0.0) & (z.t_delta < longer.t_delta);
  const AxisOfBeams along = pick(is_z, z, longer);
  const Longs is_backward = along.is_down;
  setUpAcross(pick(is_y | is_z, x, y), along, is_backward, first, beams.row);
  setUpAcross(pick(is_z, y, z), along, is_backward, first, beams.word);

  store(is_z ? Longs{} + 2 : is_y & 1, &beams.along[first]);
  store(along.num_borders, &beams.num_borders[first]);
  store(along.from(is_backward) & 7, &beams.slabs[first]);
  store(is_backward, &beams.backward[first]);
  store(x.from(is_backward) >> 3 | y.from(is_backward) >> 3 << kBrickKeyBits |
            z.from(is_backward) >> 3 << (2 * kBrickKeyBits),
        &beams.keys[first]);
  const auto length = load<Doubles>(&rays.length_m[first]);
  return x.isClear(length) & y.isClear(length) & z.isClear(length) & (along.num_borders >= 1.0) &
         (along.num_borders <= kMaxSlabs);
}

}  // namespace

std::uint32_t setUpSlabBeams(const RayBatch& rays, const Cell& base, SlabBeams& beams) {
  std::uint32_t set_up = 0;
  for (int first = 0; first < rays.count; first += 4) {
    set_up |= toBits(setUp(rays, base, first, beams)) << first;
  }
  return set_up & rays.taken;
}

}  // namespace cuboid_mapping

CUBOID_MAPPING_END_LANES
#endif
