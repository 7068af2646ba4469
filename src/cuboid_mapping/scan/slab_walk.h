// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/scan/beam_marks.h"
#include "cuboid_mapping/scan/ray_walk.h"

namespace cuboid_mapping {

/// Marks the voxels that walkRay() passes, and the voxel of the end, as misses: eight slabs at a time, in the layout
/// MarkLayout::kPlanes.
///
/// A slab is the space between two neighbouring voxel borders on the axis along which the beam is
/// longest. The beam crosses at most one border of each other axis in a slab. A fixed-point phase per
/// axis gives the slabs of a brick with crossings, without a step from voxel to voxel:
/// as many as 22 voxels of a brick are marked at once, from tables.
///
/// The phases are rounded. If two borders are closer than 2^-23 voxels, the lengths at which
/// walkRay() crosses them decide, to the last bit. The function gives up, and walkRay() has to mark
/// the beam, if the beam ends too near a border to decide whether it crosses it, if it does not leave
/// its first slab, and on diagonals of the grid. This is rare.
///
/// @param local_start  ray.start minus the base of the brick numbers: each in [0, 2^24).
/// @return Whether all voxels are marked. If not, some may be, all of them passed by the beam.
/// @complexity O(bricks passed).
[[nodiscard]] bool markSlabs(const Ray& ray, const Cell& local_start, BeamMarks& marks);

}  // namespace cuboid_mapping
