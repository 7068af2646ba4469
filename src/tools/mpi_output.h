// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/map_snapshot.h"
#include "cuboid_mapping/voxels/voxel_store.h"
#include "mpi_ranks.h"

#include <string>

namespace cuboid_mapping_ros {

/// A rank's part of a map that is divided among ranks, in one piece. @param head  The map without bricks.
[[nodiscard]] cuboid_mapping::MapSnapshot takePart(const cuboid_mapping::MapSnapshot& head,
                                                   const cuboid_mapping::VoxelStore& part);

/// Rank 0 writes the map of all ranks, in the format that the name stands for. The file is there when it is
/// complete, or not at all.
///
/// A store is written page by page: no rank holds more than its part, and some pages. For other formats rank 0 needs the
/// whole map. All ranks call it together.
///
/// @param head  Resolution, sensor model, environment and frame. @param part  The rank's own bricks.
/// @return The content of the file, at rank 0. @throws cuboid_mapping::MapFileError  At rank 0, as writeMapFile().
std::string writeMapOfAll(const MpiRanks& ranks, const cuboid_mapping::MapSnapshot& head,
                          const cuboid_mapping::VoxelStore& part, const std::string& file);

}  // namespace cuboid_mapping_ros
