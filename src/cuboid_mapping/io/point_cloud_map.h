// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/map_snapshot.h"

#include <boost/algorithm/string/predicate.hpp>

#include <string>

namespace cuboid_mapping {

/// Whether a name ends in .pcd, in lower or upper case.
[[nodiscard]] inline bool isPointCloudFile(const std::string& file) {
  return boost::algorithm::iends_with(file, ".pcd");
}

/// Map of a cloud of points in the map's frame, as SLAM programs save it: voxels with a point are occupied,
/// with the greatest log-odds; all others are unknown. Points that are not finite, or beyond the grid, are left
/// out.
/// @throws std::runtime_error as readPcd(), and for a file without a point.
[[nodiscard]] MapSnapshot readPointCloudMap(const std::string& file, double resolution_m,
                                            const SensorModelConfig& model);

/// readPointCloudMap() for those who load the library while they run.
// NOLINTNEXTLINE(readability-identifier-naming): a symbol of C, in the names of all libraries.
extern "C" void cuboid_mapping_read_point_cloud_map(const std::string& file, double resolution_m,
                                                    const SensorModelConfig& model,
                                                    MapSnapshot& snapshot);

}  // namespace cuboid_mapping
