// SPDX-License-Identifier: BSD-3-Clause
// OctoMap's files: .ot (log-odds) and .bt (free or occupied).
#pragma once

#include "cuboid_mapping/io/map_file_error.h"
#include "cuboid_mapping/map/map_snapshot.h"

#include <string>
#include <string_view>

namespace cuboid_mapping {

/// Content of an OctoMap file: log-odds, or classes only.
enum class OctreeKind : unsigned char {
  kFull,   ///< Pruned where log-odds are equal; inner nodes have the greatest log-odds below them.
  kBinary  ///< Pruned where classes are equal, as after octomap's toMaxLikelihood() and prune().
};

/// Whether bytes begin as an OctoMap file.
[[nodiscard]] bool isOctomapFile(std::string_view bytes);

/// A snapshot as the bytes of an OctoMap file: those of octomap::OcTree::write (kFull) or writeBinary (kBinary)
/// for these voxels. The file has no sensor model and no frame.
/// @throws MapFileError (kTooBig) for voxels beyond +-32768, which an octree cannot hold.
[[nodiscard]] std::string toOctomapFile(const MapSnapshot& snapshot, OctreeKind kind);

/// Reads either format: trees of type OcTree, OcTreeStamped and ColorOcTree, without stamps and colours.
///
/// Cases:
///   - .ot: log-odds are taken as they are;
///   - .bt: free voxels get the least, occupied ones the greatest log-odds of the sensor model.
///
/// @param model  Sensor model of the snapshot, since the files have none.
/// @throws MapFileError: kForeign for another first line or type of tree, kTruncated, kCorrupted,
///         kTooBig for more nodes than the bytes can hold, or more bricks than the limit.
[[nodiscard]] MapSnapshot fromOctomapFile(std::string_view bytes,
                                          const SensorModelConfig& model = {},
                                          const SnapshotLimits& limits = {});

}  // namespace cuboid_mapping
