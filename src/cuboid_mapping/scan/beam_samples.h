// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/grid.h"
#include "cuboid_mapping/scan/beam_sampling.h"
#include "cuboid_mapping/scan/scan.h"

#include <cstdint>
#include <vector>

namespace cuboid_mapping {

/// Cells at random places along the returns and no-returns of a scan, in proportion to the length of each beam.
///
/// Sampling covers the observed part of a beam: up to its end, or where it is cut. Beams that end
/// outside the grid, are not finite, or are longer than kMaxBeamVoxels are left out.
///
/// @param max_range_m  > 0; infinity for no limit.
/// @param number  Number of the scan, so that every scan draws differently.
/// @return Each cell once, in the order of Cell's operator<.
/// @complexity O(p + s log s) for p points and s samples.
[[nodiscard]] std::vector<Cell> sampleBeams(const Grid& grid, const Scan& scan, double max_range_m,
                                            const BeamSampling& sampling, std::uint64_t number);

}  // namespace cuboid_mapping
