// SPDX-License-Identifier: BSD-3-Clause
// Inside of markSlabsAvx2().
#pragma once

#include "cuboid_mapping/scan/ray_batch.h"

#include <cstdint>

namespace cuboid_mapping {

/// An axis across some beams, by beam: as CrossedAxis of markSlabs().
struct AcrossAxes {
  alignas(32) double phases[RayBatch::kSize];  ///< At the far end of the beam's first slab.
  alignas(32) double slopes[RayBatch::kSize];
  alignas(32) double num_borders[RayBatch::kSize];
  alignas(32) std::int64_t voxels[RayBatch::kSize];
  alignas(32) std::int64_t mirrors[RayBatch::kSize];
};

/// Beams in arrays: as SlabBeam of markSlabs().
struct SlabBeams {
  alignas(32) double num_slabs[RayBatch::kSize];
  alignas(32) std::int64_t along[RayBatch::kSize];
  alignas(32) std::int64_t keys[RayBatch::kSize];
  alignas(32) std::int64_t slabs[RayBatch::kSize];
  AcrossAxes row;
  AcrossAxes word;
};

/// Sets up beams for the walk, as SlabBeam of markSlabs() does.
/// @param rays, base  As of markSlabsAvx2().
/// @return Those that are set up.
[[nodiscard]] std::uint32_t setUpSlabBeams(const RayBatch& rays, const Cell& base,
                                           SlabBeams& beams);

}  // namespace cuboid_mapping
