// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/scan/beam_marks.h"
#include "cuboid_mapping/scan/ray_batch.h"

#include <cstdint>

namespace cuboid_mapping {

/// Marks what markSlabs() marks, as MarkLayout::kSlabs: without a branch for where in a brick the beam
/// crosses borders, which no processor foresees.
///
/// It decides nothing to the last bit: it gives a beam up wherever two borders are closer than 2^-22
/// voxels. Only where the origin lies on borders of voxels, as that of a map often does, walkRay()'s
/// first steps are taken one by one.
///
/// @param rays  Those that are taken; afterwards they start where those steps have led.
/// @param base  Of the brick numbers; starts and ends minus it are in [0, 2^24).
/// @return Those of which all voxels are marked. Of others some may be; none that they do not pass.
/// @pre hasAvx2().
/// @complexity O(bricks passed).
[[nodiscard]] std::uint32_t markSlabsAvx2(RayBatch& rays, const Cell& base, BeamMarks& marks);

}  // namespace cuboid_mapping
