// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/ray_batch.h"

#include "cuboid_mapping/scan/lanes.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cuboid_mapping {

#ifdef CUBOID_MAPPING_HAS_LANES

// Headers included above must use only the instructions that every processor has.
CUBOID_MAPPING_BEGIN_LANES

namespace {

using namespace lanes;

/// Points or differences of points, by axis.
struct FloatVectors {
  Floats axis[3];
};

Doubles toDoubles(const Floats& floats) { return __builtin_convertvector(floats, Doubles); }
Floats toFloats(const Doubles& doubles) { return __builtin_convertvector(doubles, Floats); }

/// @param count  Number of points; later lanes are copies of the last.
FloatVectors loadPoints(const Eigen::Vector3f* points, int count) {
  FloatVectors loaded;
  for (int i = 0; i < 4; ++i) {
    const float* point = points[std::min(i, count - 1)].data();
    for (int axis = 0; axis < 3; ++axis) loaded.axis[axis][i] = point[axis];
  }
  return loaded;
}

FloatVectors subtract(const FloatVectors& points, const Eigen::Vector3f& origin) {
  FloatVectors ways;
  for (int axis = 0; axis < 3; ++axis) ways.axis[axis] = points.axis[axis] - origin[axis];
  return ways;
}

Doubles computeLengths(const FloatVectors& ways) {
  const auto& [x, y, z] = ways.axis;
  const Floats squared = x * x + y * y + z * z;
  return squareRoots(toDoubles(squared));
}

/// As cutBeam(). @return Beams that were cut.
Longs cutBeams(const Eigen::Vector3f& origin, double max_range_m, FloatVectors& ends) {
  const FloatVectors ways = subtract(ends, origin);
  const Doubles lengths_m = computeLengths(ways);
  const Longs is_cut = lengths_m > max_range_m;
  const auto is_cut_float = __builtin_convertvector(is_cut, Ints);
  const Floats lengths = toFloats(lengths_m);
  for (int axis = 0; axis < 3; ++axis) {
    const Floats cut = origin[axis] + ways.axis[axis] / lengths * static_cast<float>(max_range_m);
    ends.axis[axis] = is_cut_float ? cut : ends.axis[axis];
  }
  return is_cut;
}

/// @param first  Index of the first of four rays. @return Rays that are set up.
Longs computeRays(const RayOrigin& origin, const FloatVectors& ends, int first, RayBatch& rays) {
  constexpr double kEnd = Grid::kMaxCell;
  constexpr double kNoCrossing = std::numeric_limits<double>::max();
  const FloatVectors ways = subtract(ends, origin.point());
  const Floats lengths = toFloats(computeLengths(ways));
  const Doubles lengths_m = toDoubles(lengths);
  Longs is_taken = (lengths_m > 0.0) & (lengths_m < std::numeric_limits<double>::infinity());
  store(lengths_m, &rays.length_m[first]);
  for (int axis = 0; axis < 3; ++axis) {
    const Doubles cells =
        (origin.anchor()[axis] + toDoubles(ends.axis[axis])) * origin.grid().inverseResolution();
    const Doubles end_cells = floors(cells);
    const Doubles voxels = end_cells - (*origin.cell())[axis];
    is_taken &= (cells >= -kEnd) & (cells < kEnd) & (voxels <= kMaxBeamVoxels) &
                (voxels >= -kMaxBeamVoxels);
    store(__builtin_convertvector(end_cells, Ints), &rays.end[axis][first]);
    store(Ints{} + (*origin.cell())[axis], &rays.start[axis][first]);

    const Doubles component = toDoubles(ways.axis[axis] / lengths);
    const Doubles up = Doubles{} + origin.toBorder(axis, true);
    const Doubles down = Doubles{} + origin.toBorder(axis, false);
    const Doubles t_max = (component > 0.0 ? up : down) / component;
    const Doubles t_delta = origin.grid().resolution() / (component < 0.0 ? -component : component);
    const Longs is_never = component == 0.0;
    store(is_never ? Doubles{} + kNoCrossing : t_max, &rays.t_max[axis][first]);
    store(is_never ? Doubles{} + kNoCrossing : t_delta, &rays.t_delta[axis][first]);
  }
  return is_taken;
}

}  // namespace

void computeRays(const RayOrigin& origin, const Eigen::Vector3f* ends, int count,
                 double max_range_m, RayBatch& rays) {
  rays.count = count;
  rays.taken = 0;
  rays.cut = 0;
  for (int first = 0; first < count; first += 4) {
    FloatVectors four = loadPoints(ends + first, count - first);
    if (std::isfinite(max_range_m)) {
      rays.cut |= toBits(cutBeams(origin.point(), max_range_m, four)) << first;
    }
    rays.taken |= toBits(computeRays(origin, four, first, rays)) << first;
  }
  rays.taken &= RayBatch::all(count);
}

CUBOID_MAPPING_END_LANES

bool hasLanes() {
#ifdef __x86_64__
  static const bool kHasAvx2 = __builtin_cpu_supports("avx2") != 0;
  return kHasAvx2;
#else
  return true;
#endif
}

#else

bool hasLanes() { return false; }
void computeRays(const RayOrigin&, const Eigen::Vector3f*, int, double, RayBatch&) {}

#endif

}  // namespace cuboid_mapping
