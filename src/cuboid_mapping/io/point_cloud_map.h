// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/map_snapshot.h"

#include <string>

namespace cuboid_mapping {

/// Whether a name ends in .pcd, in lower or upper case.
[[nodiscard]] bool isPointCloudFile(const std::string& file);

/// Map of a cloud of points in the map's frame, as SLAM programs save it: voxels with a point are occupied,
/// with the greatest log-odds; all others are unknown. Points that are not finite, or beyond the grid, are left
/// out.
/// @throws std::runtime_error as readPcd(), and for a file without a point.
[[nodiscard]] MapSnapshot readPointCloudMap(const std::string& file, double resolution_m,
                                            const SensorModelConfig& model);

}  // namespace cuboid_mapping
