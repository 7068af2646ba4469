// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/scan/beam_marks.h"
#include "cuboid_mapping/scan/ray_walk.h"

#include <cstdint>
#include <cstdlib>

namespace cuboid_mapping {

/// Phases are fixed-point numbers of borders crossed: 16 bits before the point, 48 after it.
constexpr int kPhaseBits = 48;
constexpr int kMaxSlabs = 30000;  ///< Counts of borders fit into a phase.
/// How near a border rounding may move a phase across it.
constexpr std::int64_t kUnsure = 1LL << (kPhaseBits - 22);
/// Share of a length that rounding errors of sums of up to 2^16 terms do not reach.
constexpr double kUnsureShare = 1.0 / (1ULL << 32);

/// One of the two axes across the beam. Coordinates are mirrored where the beam goes down the axis,
/// so that it always goes up.
struct AcrossAxis {
  int axis = 0;
  double t_first = 0.0;  ///< Where the beam crosses the first border, as lengths of Ray.
  double t_delta = 0.0;  ///< From one border to the next.
  std::int64_t phase = 1LL << (kPhaseBits - 1);  ///< At the far end of the brick's first slab.
  std::int64_t slope = 0;                        ///< Change of the phase per slab.
  int num_borders = 0;                           ///< All that the beam crosses.
  int voxel = 0;                                 ///< Where it enters the brick, mirrored: 0 to 7.
  int mirror = 0;         ///< 7 where coordinates are mirrored: 7 - i is i ^ 7.
  BrickKey key_step = 0;  ///< To the next brick.
};

/// A beam, set up for a walk from slab to slab: up the axis along which it is longest, whether that
/// is from the origin to the end or back.
/// @tparam AxisT  AcrossAxis, or derived from it.
template <typename AxisT>
struct SlabBeam {
  int along = 0;             ///< The axis along which it is longest.
  bool is_backward = false;  ///< The walk goes from the end to the origin.
  double margin = 0.0;  ///< Lengths that are nearer than this may be in another order in walkRay().
  int num_borders[3] = {0, 0, 0};
  BrickKey key = 0;  ///< Of the brick where the walk begins.
  int slab = 0;      ///< Of that brick, where the walk begins.
  AxisT row;
  AxisT word;

  /// @param local_start  ray.start minus the base of the brick numbers: each in [0, 2^24).
  /// @return false when the beam ends too near a border to say that it crosses it, or does not leave
  /// its first slab.
  [[nodiscard]] bool setUp(const Ray& ray, const Cell& local_start);

 private:
  void setUpAcross(AcrossAxis& across, const Ray& ray, int axis, const Cell& local_from) const;
  [[nodiscard]] double firstCrossing(const Ray& ray, int axis) const;
};

template <typename AxisT>
double SlabBeam<AxisT>::firstCrossing(const Ray& ray, int axis) const {
  if (!is_backward) return ray.t_max[axis];
  return -(ray.t_max[axis] + (num_borders[axis] - 1) * ray.t_delta[axis]);
}

template <typename AxisT>
void SlabBeam<AxisT>::setUpAcross(AcrossAxis& across, const Ray& ray, int axis,
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

template <typename AxisT>
bool SlabBeam<AxisT>::setUp(const Ray& ray, const Cell& local_start) {
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

}  // namespace cuboid_mapping
