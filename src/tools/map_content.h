// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/io/map_files.h"

#include <string>

namespace cuboid_mapping {

/// Content of a map file in a format: "12 voxels"; .pcd and .ply "3 points", .csv "2 cuboids".
[[nodiscard]] std::string describeContent(const MapSnapshot& map, MapFormat format);

}  // namespace cuboid_mapping
