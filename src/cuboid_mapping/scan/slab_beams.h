// SPDX-License-Identifier: BSD-3-Clause
// Internal to markSlabs().
#pragma once

#include "cuboid_mapping/scan/ray_batch.h"

#include <cstdint>

namespace cuboid_mapping {

/// Bits after the point in phases, fixed-point numbers of crossed borders, with 16 bits before it.
constexpr int kPhaseBits = 48;
constexpr int kMaxSlabs = 30000;  ///< Maximum number of slabs: counts of borders fit into a phase.
/// Distance to a border within which rounding may move a phase across it.
constexpr std::int64_t kUnsure = 1LL << (kPhaseBits - 22);
/// Bound of rounding errors in sums of up to 2^16 terms, as a share of the length.
constexpr double kUnsureShare = 1.0 / (1ULL << 32);

/// An axis across the beams, in arrays.
struct AcrossAxes {
  alignas(32) double phases[RayBatch::kSize];  ///< Phase at the far end of the first slab.
  alignas(32) double slopes[RayBatch::kSize];  ///< Change of the phase per slab.
  alignas(32) double num_borders[RayBatch::kSize];
  /// Where the walk begins in its brick, mirrored: 0 to 7.
  alignas(32) std::int64_t voxels[RayBatch::kSize];
  /// 7 if coordinates are mirrored, so that the walk goes up: 7 - i is i ^ 7.
  alignas(32) std::int64_t mirrors[RayBatch::kSize];
};

/// Beams in arrays, each set up for a walk up its longest axis, from its origin to its end or back.
struct SlabBeams {
  /// Borders that the beam crosses on its longest axis.
  alignas(32) double num_borders[RayBatch::kSize];
  alignas(32) std::int64_t along[RayBatch::kSize];  ///< The longest axis.
  alignas(32) std::int64_t keys[RayBatch::kSize];   ///< Number of the brick where the walk begins.
  alignas(32) std::int64_t slabs[RayBatch::kSize];  ///< Slab of that brick where the walk begins.
  alignas(32) std::int64_t backward[RayBatch::kSize];  ///< Not 0 if the walk begins at the end.
  AcrossAxes row;
  AcrossAxes word;
};

/// Sets up beams for the walk.
/// @param rays, base  As for markSlabs().
/// @return Beams that are set up: all except beams that end too near a border to decide whether they cross it,
/// do not leave their first slab, or pass more than kMaxSlabs.
[[nodiscard]] std::uint32_t setUpSlabBeams(const RayBatch& rays, const Cell& base,
                                           SlabBeams& beams);

}  // namespace cuboid_mapping
