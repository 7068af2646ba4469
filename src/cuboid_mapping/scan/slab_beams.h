// SPDX-License-Identifier: BSD-3-Clause
// Internal to markSlabsAvx2().
#pragma once

#include "cuboid_mapping/scan/ray_batch.h"

#include <cstdint>

namespace cuboid_mapping {

/// An axis across the beams, in arrays: like CrossedAxis of markSlabs().
struct AcrossAxes {
  alignas(32) double phases[RayBatch::kSize];  ///< Phase at the far end of the first slab.
  alignas(32) double slopes[RayBatch::kSize];
  alignas(32) double num_borders[RayBatch::kSize];
  alignas(32) std::int64_t voxels[RayBatch::kSize];
  alignas(32) std::int64_t mirrors[RayBatch::kSize];
};

/// Beams in arrays: like SlabBeam of markSlabs().
struct SlabBeams {
  alignas(32) double num_slabs[RayBatch::kSize];
  alignas(32) std::int64_t along[RayBatch::kSize];
  alignas(32) std::int64_t keys[RayBatch::kSize];
  alignas(32) std::int64_t slabs[RayBatch::kSize];
  AcrossAxes row;
  AcrossAxes word;
};

/// Sets up beams for the walk, as SlabBeam of markSlabs() does.
/// @param rays, base  As for markSlabsAvx2().
/// @return Beams that are set up.
[[nodiscard]] std::uint32_t setUpSlabBeams(const RayBatch& rays, const Cell& base,
                                           SlabBeams& beams);

}  // namespace cuboid_mapping
