// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/scan/ray_walk.h"
#include "cuboid_mapping/scan/scan.h"

namespace cuboid_mapping {

/// Whether ColumnWalk is expected to be clearly cheaper for a scan than the walk of each beam, from the density
/// of a part of the beams.
/// @pre origin.cell().
[[nodiscard]] bool areDense(const Scan& scan, const RayOrigin& origin, double max_range_m);

}  // namespace cuboid_mapping
