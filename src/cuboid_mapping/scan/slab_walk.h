// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/scan/beam_marks.h"
#include "cuboid_mapping/scan/ray_batch.h"

#include <array>
#include <cstdint>

namespace cuboid_mapping {

/// The end margins of a batch of rays.
struct BatchMargins {
  BeamMarks& grazes;
  std::array<MarginSlabs, RayBatch::kSize> slabs{};
};

/// Marks the voxels that walkRay() passes, and the voxel of the end, as misses: eight slabs at a time, without
/// a branch on the places of crossings in a brick, which processors cannot predict.
///
/// A slab is the space between two neighbouring voxel borders on the axis along which the beam is
/// longest. The beam crosses at most one border of each other axis in a slab. A fixed-point phase per
/// axis gives the voxels where it enters and leaves each slab of a brick.
///
/// Phases are rounded. Where rounding could decide, the function leaves the beam to walkRay(): if a border or two
/// borders lie within about 2^-21 voxels where it matters, if the beam ends too near a border, or if it does not leave
/// its first slab. This is rare. If the origin lies on borders of voxels, as a map's origin often does, it takes the first
/// steps of walkRay() one by one.
///
/// @param rays  Rays to walk; afterwards they start after those steps.
/// @param base  Base of the brick numbers; starts and ends minus it are in [0, 2^24).
/// @param num_done  Slabs from the origin's on that are marked already. The bricks that they fill are left out.
/// @param margins  Where beams mark grazes in place of misses.
/// @return Beams with all voxels marked. Others may have some, all of them passed by the beam.
/// @pre hasLanes().
/// @complexity O(bricks passed).
[[nodiscard]] std::uint32_t markSlabs(RayBatch& rays, const Cell& base, BeamMarks& marks,
                                      int num_done = 0, const BatchMargins* margins = nullptr);

}  // namespace cuboid_mapping
