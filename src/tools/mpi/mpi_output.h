// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/map_snapshot.h"
#include "cuboid_mapping/voxels/voxel_store.h"
#include "mpi/mpi_ranks.h"

#include <string>

namespace cuboid_mapping_ros {

/// A rank's part of a map that is divided among ranks, as a snapshot. @param head  The map without bricks.
[[nodiscard]] cuboid_mapping::MapSnapshot takePart(const cuboid_mapping::MapSnapshot& head,
                                                   const cuboid_mapping::VoxelStore& part);

/// Writes the map of all ranks at rank 0, in the format of the file's extension. The file exists when it is
/// complete, or not at all.
///
/// A store is written page by page: no rank holds more than its part, and some pages. For other formats rank 0
/// needs the whole map. All ranks call it together.
///
/// @param head  Resolution, sensor model, environment and frame. @param part  The rank's own bricks.
/// @return The content of the file, at rank 0. @throws cuboid_mapping::MapFileError  At rank 0, as
///          writeMapFile().
std::string writeMapOfAll(const MpiRanks& ranks, const cuboid_mapping::MapSnapshot& head,
                          const cuboid_mapping::VoxelStore& part, const std::string& file);

}  // namespace cuboid_mapping_ros
