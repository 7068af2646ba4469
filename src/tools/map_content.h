// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/io/map_files.h"

#include <string>

namespace cuboid_mapping {

/// The format of a map to write, for programs that work long before. @throws std::runtime_error if the file's name has
/// none, or it could not be written.
[[nodiscard]] MapFormat checkOutput(const std::string& file);

/// Content of a map file in a format: "12 voxels"; .pcd and .ply "3 points", .csv "2 cuboids".
[[nodiscard]] std::string describeContent(const MapSnapshot& map, MapFormat format);

}  // namespace cuboid_mapping
