// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/scan/ray_walk.h"

#include <cstdint>

namespace cuboid_mapping {

/// Rays from one origin in arrays, so that a processor sets up four at once.
struct RayBatch {
  /// Number of rays: a set of them is one word.
  static constexpr int kSize = 32;

  int count = 0;
  std::uint32_t taken = 0;  ///< Beams that are set up, see RayOrigin::computeRay().
  std::uint32_t cut = 0;    ///< Beams that end at the max range; counts for taken ones only.
  /// Members of Ray, by axis and number; undefined for other beams.
  ///@{
  alignas(32) double t_max[3][kSize];
  alignas(32) double t_delta[3][kSize];
  alignas(32) double length_m[kSize];
  alignas(16) std::int32_t start[3][kSize];
  alignas(16) std::int32_t end[3][kSize];
  ///@}

  /// The first `count` rays. @pre 1 <= count <= kSize.
  [[nodiscard]] static constexpr std::uint32_t all(int count) {
    return 0xFFFFFFFFU >> (kSize - count);
  }
  [[nodiscard]] Cell startOf(std::size_t ray) const {
    return {start[0][ray], start[1][ray], start[2][ray]};
  }
  [[nodiscard]] Cell endOf(std::size_t ray) const {
    return {end[0][ray], end[1][ray], end[2][ray]};
  }
  /// A ray, without its steps.
  [[nodiscard]] Ray rayOf(std::size_t ray) const {
    return {startOf(ray),
            endOf(ray),
            {},
            {t_max[0][ray], t_max[1][ray], t_max[2][ray]},
            {t_delta[0][ray], t_delta[1][ray], t_delta[2][ray]},
            length_m[ray]};
  }
};

/// Whether this processor has the vectors of computeRays() and markSlabs(): AVX2, or NEON of ARM64.
[[nodiscard]] bool hasLanes();

/// Sets up beams to some points, with the same bits as RayOrigin::computeRay(). Beams that it refuses, of
/// no length, or beyond reach are left out.
/// @param count  1 to RayBatch::kSize.
/// @param max_range_m  Longer beams are cut, see cutBeam().
/// @pre hasLanes(), and origin.cell().
void computeRays(const RayOrigin& origin, const Eigen::Vector3f* ends, int count,
                 double max_range_m, RayBatch& rays);

}  // namespace cuboid_mapping
