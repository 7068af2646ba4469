// SPDX-License-Identifier: BSD-3-Clause
// Maps in files of any known format.
#pragma once

#include "cuboid_mapping/io/map_file_error.h"
#include "cuboid_mapping/map/map_snapshot.h"
#include "cuboid_mapping/map/progress_listener.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping {

/// Formats of maps.
enum class MapFormat : unsigned char {
  kNative,         ///< .cuboids: voxels, locks and fused cuboids.
  kStore,          ///< .sqlite: voxels and progress, page by page; see map_store.h.
  kOctomapFull,    ///< .ot: voxels with log-odds.
  kOctomapBinary,  ///< .bt: voxels with classes.
  kPcd,  ///< .pcd: centres of occupied voxels, with probability as intensity. Only written.
  kPly,  ///< .ply: the same as .pcd. Only written.
  kCsv   ///< .csv: a line for each cuboid. Only written.
};

/// Name of a format: "native", "OctoMap .ot" ...
[[nodiscard]] const char* toString(MapFormat format);

/// The format of a file name's extension, in lower or upper case; nothing for another one.
[[nodiscard]] std::optional<MapFormat> formatOfName(const std::string& file);

/// All extensions, for messages: ".cuboids, .sqlite, .ot, .bt, .pcd, .ply, .csv".
[[nodiscard]] std::string knownEndings();

/// A map and the format of its file.
struct MapFile {
  MapFormat format = MapFormat::kNative;  ///< Format by the first bytes.
  MapSnapshot snapshot;                   ///< The map.
  std::size_t num_bytes = 0;              ///< Size of the file.
};

/// Reads a map. The first bytes decide the format, not the name; only a file named .sqlite must be a store.
///
/// @param model  Sensor model for OctoMap files, which have none. @param limits  For files of others.
/// @throws MapFileError whose text names the file. See the readers of the formats.
[[nodiscard]] MapFile readMapFile(const std::string& file, const SensorModelConfig& model = {},
                                  const SnapshotLimits& limits = SnapshotLimits::none());

/// Replaces a file by a map, as a whole or not at all, in the format of the file's extension. An existing store
/// stays the same file, and gets the map in one transaction.
/// @param listener  Reports bricks, or pages of a store; nothing for .ot and .bt.
/// @return Bytes of the file.
/// @throws MapFileError whose text names the file: kForeign for an unknown
///         extension; kTooBig for a map that a format cannot hold; kInaccessible.
std::size_t writeMapFile(const std::string& file, const MapSnapshot& snapshot,
                         const ProgressListener& listener = {});

/// A map from a file of any known format, with the resolution, the sensor model and the environment of the
/// file.
/// @throws MapFileError as readMapFile().
[[nodiscard]] CuboidMap loadMap(const std::string& file);

/// Replaces everything in a map by a file, also its locks. The map keeps its sensor model and environment.
/// @throws MapFileError as readMapFile(); kForeign for a file of another resolution: it is not rescaled. The
///         map is then as it was.
ChangeSet loadMap(const std::string& file, CuboidMap& map);

/// Replaces a file by a map, as writeMapFile(). @param frame_id  Frame of the map. @return Bytes of the file.
/// @throws MapFileError as writeMapFile().
std::size_t saveMap(const CuboidMap& map, const std::string& file,
                    const std::string& frame_id = "map");

}  // namespace cuboid_mapping
