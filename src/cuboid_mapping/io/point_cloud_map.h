// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/map_snapshot.h"

#include <string>

namespace cuboid_mapping {

/// Whether a name ends in .pcd, in lower or upper case.
[[nodiscard]] bool isPointCloudFile(const std::string& file);

/// A map of a cloud of points in its frame, such as a SLAM program saves: the voxels with a point are occupied, as certainly
/// as they can be, all others are unknown. Points that are not finite, or beyond the grid, are left out.
/// @throws std::runtime_error as readPcd(), and for a file without a point.
[[nodiscard]] MapSnapshot readPointCloudMap(const std::string& file, double resolution_m,
                                            const SensorModelConfig& model);

}  // namespace cuboid_mapping
