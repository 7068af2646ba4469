// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/map_snapshot.h"
#include "cuboid_mapping/map/progress_listener.h"

#include <string>

namespace cuboid_mapping {

/// Format of a file of points.
enum class PointCloudFormat : unsigned char { kPcd, kPly };

/// Writes the centres of the occupied voxels, in metres (map frame), with the probability as
/// intensity. Binary. Coordinates are float32 if that resolves voxels to a hundredth of their edge;
/// else, far from the origin (UTM), float64 for the whole file.
/// @param listener  Reports bricks.
/// @throws MapFileError (kInaccessible) naming the file; a full disk, too.
void writePointCloud(const std::string& file, const MapSnapshot& snapshot, PointCloudFormat format,
                     const ProgressListener& listener);

}  // namespace cuboid_mapping
