// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/map_snapshot.h"

#include <string>

namespace cuboid_mapping_ros {

/// readPointCloudMap() of the library cuboid_mapping::scans, which is loaded at the first call: a node that reads no
/// .pcd file needs neither PCL's readers nor VTK, which these bring.
/// @throws std::runtime_error  if the library is not installed, or naming the file and its defect.
[[nodiscard]] cuboid_mapping::MapSnapshot loadPointCloudMap(
    const std::string& file, double resolution_m, const cuboid_mapping::SensorModelConfig& model);

}  // namespace cuboid_mapping_ros
