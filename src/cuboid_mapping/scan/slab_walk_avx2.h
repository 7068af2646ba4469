// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/scan/beam_marks.h"
#include "cuboid_mapping/scan/ray_batch.h"

#include <cstdint>

namespace cuboid_mapping {

/// Marks the same voxels as markSlabs(), in the layout MarkLayout::kSlabs: without a branch on the places of
/// crossings in a brick, which processors cannot predict.
///
/// It decides nothing to the last bit: it gives a beam up if two borders are closer than 2^-22
/// voxels. Only if the origin lies on borders of voxels, as a map's origin often does, walkRay()'s
/// first steps are taken one by one.
///
/// @param rays  Rays to walk; afterwards they start after those steps.
/// @param base  Base of the brick numbers; starts and ends minus it are in [0, 2^24).
/// @return Beams with all voxels marked. Others may have some, all of them passed by the beam.
/// @pre hasAvx2().
/// @complexity O(bricks passed).
[[nodiscard]] std::uint32_t markSlabsAvx2(RayBatch& rays, const Cell& base, BeamMarks& marks);

}  // namespace cuboid_mapping
