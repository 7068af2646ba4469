// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/scan/beam_marks.h"
#include "cuboid_mapping/scan/ray_walk.h"

namespace cuboid_mapping {

/// Whether this processor, and the compiler that made the package, have what markSlabsAvx2() needs.
[[nodiscard]] bool hasSlabWalkAvx2();

/// Marks what markSlabs() marks, in BrickMarks::slabs: without a branch for where in a brick the beam
/// crosses borders, which no processor foresees.
///
/// It decides nothing to the last bit: it gives up wherever two borders are closer than 2^-22 voxels.
/// Only where the origin lies on borders of voxels, as that of a map often does, walkRay()'s first
/// steps are taken one by one.
///
/// @param local_start  ray.start minus the base of the brick numbers: each in [0, 2^24).
/// @return Whether all voxels are marked. If not, some may be; none that the beam does not pass.
/// @pre hasSlabWalkAvx2().
/// @complexity O(bricks passed).
[[nodiscard]] bool markSlabsAvx2(const Ray& ray, const Cell& local_start, BeamMarks& marks);

}  // namespace cuboid_mapping
