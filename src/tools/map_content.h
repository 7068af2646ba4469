// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/io/map_files.h"

#include <string>

namespace cuboid_mapping {

/// What a file of a map holds in a format: "12 voxels"; .pcd and .ply "3 points", .csv "2 cuboids".
[[nodiscard]] std::string describeContent(const MapSnapshot& map, MapFormat format);

}  // namespace cuboid_mapping
