// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/map/map_snapshot.h"
#include "cuboid_mapping/map/progress_listener.h"

#include <string>
#include <vector>

namespace cuboid_mapping {

/// Writes a header line, then for each cuboid the faces in metres (map frame), the probability, and
/// "free" or "occupied", brick by brick: the cuboids of the snapshot's fusion. With kClass, bricks that share a voxel
/// with one of its fused cuboids that fit the voxels have these and single cells. @param listener  Reports bricks.
[[nodiscard]] std::string toCsv(const MapSnapshot& snapshot, const ProgressListener& listener);
/// As above, for cuboids of a map, such as joined ones, in their order.
[[nodiscard]] std::string toCsv(const CuboidMap& map, const std::vector<Cuboid>& cuboids);

}  // namespace cuboid_mapping
