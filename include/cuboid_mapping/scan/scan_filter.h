// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/grid.h"
#include "cuboid_mapping/scan/scan.h"

#include <cstddef>
#include <optional>

namespace cuboid_mapping {

/// Limits of the points that take part.
struct ScanLimits {
  double min_range_m = 0.0;  ///< Nearer points are left out.
  /// Crop box, faces included: points outside are left out.
  std::optional<MetricBox> crop_map = std::nullopt;
};

/// Whether a point lies in a box whose faces are inside; false for NaN.
[[nodiscard]] bool isInside(const MetricBox& box, const Eigen::Vector3d& point);

/// Numbers of points that filterScan() has left out, by reason; each point counts once.
struct FilterCounts {
  std::size_t num_too_near = 0;      ///< Points nearer than min_range_m, in the crop or not.
  std::size_t num_outside_crop = 0;  ///< Points with a NaN coordinate count here.
};

/// Removes points outside the limits with their beams, as octomap_server does: neither a hit, nor misses on the
/// way.
///
/// The remaining points keep their order. No-returns, open ends and free points all stay: no-returns are ends
/// of free space, not measured points, which could belong to the robot or the ceiling. @complexity O(points).
/// @throws std::invalid_argument  min_range_m is NaN.
FilterCounts filterScan(Scan& scan, const ScanLimits& limits);

}  // namespace cuboid_mapping
