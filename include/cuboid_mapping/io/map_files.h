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
  kNative,         ///< .cuboids: voxels and locks.
  kStore,          ///< .sqlite: everything, page by page; see map_store.h.
  kOctomapFull,    ///< .ot: voxels with log-odds.
  kOctomapBinary,  ///< .bt: voxels with classes.
  kPcd,            ///< .pcd: centres of occupied voxels, intensity: probability. Only written.
  kPly,            ///< .ply: the same. Only written.
  kCsv             ///< .csv: a line for each cuboid. Only written.
};

/// "native", "OctoMap .ot" ...
[[nodiscard]] const char* toString(MapFormat format);

/// The format that the end of a name stands for, in lower or upper case; nothing for another one.
[[nodiscard]] std::optional<MapFormat> formatOfName(const std::string& file);

/// ".cuboids, .sqlite, .ot, .bt, .pcd, .ply, .csv", for messages.
[[nodiscard]] std::string knownEndings();

/// A map and how its file was stored.
struct MapFile {
  MapFormat format = MapFormat::kNative;  ///< As its first bytes tell.
  MapSnapshot snapshot;                   ///< The map.
  std::size_t num_bytes = 0;              ///< Size of the file.
};

/// Reads a map; its format is told by its first bytes, not by its name.
///
/// @param model  Of a map that comes from an OctoMap file: these have none.
/// @throws MapFileError whose text begins with the name of the file. See the readers of the formats.
[[nodiscard]] MapFile readMapFile(const std::string& file, const SensorModelConfig& model = {},
                                  const SnapshotLimits& limits = {});

/// Replaces a file by a map, in the format that its name stands for; see replaceFile(). A store that is there stays
/// the same file, and gets the map in one transaction.
/// @param listener  Is told of the bricks that have been written, of a store of its pages; of .ot and .bt of nothing.
/// @return Bytes of the file.
/// @throws MapFileError whose text begins with the name of the file: kForeign for a name without a
///         known end; kTooBig for a map that a format cannot hold; kInaccessible.
std::size_t writeMapFile(const std::string& file, const MapSnapshot& snapshot,
                         const ProgressListener& listener = {});

/// A map from a file of any known format, with the resolution, the sensor model and the environment of the file.
/// @throws MapFileError as readMapFile().
[[nodiscard]] CuboidMap loadMap(const std::string& file);

/// Replaces everything in a map by a file. The map keeps its sensor model and environment.
/// @throws MapFileError as readMapFile(); kForeign for a file of another resolution: it is not rescaled. The map is then
///         as it was.
ChangeSet loadMap(const std::string& file, CuboidMap& map);

/// Replaces a file by a map, as writeMapFile(). @param frame_id  Of the map. @return Bytes of the file.
/// @throws MapFileError as writeMapFile().
std::size_t saveMap(const CuboidMap& map, const std::string& file,
                    const std::string& frame_id = "map");

}  // namespace cuboid_mapping
