// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/map_files.h"

#include "cuboid_mapping/io/csv_format.h"
#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/map_store.h"
#include "cuboid_mapping/io/native_format.h"
#include "cuboid_mapping/io/octomap_files.h"
#include "cuboid_mapping/io/point_cloud_files.h"
#include "cuboid_mapping/io/text.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <system_error>

namespace cuboid_mapping {
namespace {

struct FormatName {
  MapFormat format;
  const char* ending;
  const char* name;
};

constexpr FormatName kFormats[] = {
    {MapFormat::kNative, "cuboids", "native"},
    {MapFormat::kStore, "sqlite", "store"},
    {MapFormat::kOctomapFull, "ot", "OctoMap .ot"},
    {MapFormat::kOctomapBinary, "bt", "OctoMap .bt"},
    {MapFormat::kPcd, "pcd", "PCD"},
    {MapFormat::kPly, "ply", "PLY"},
    {MapFormat::kCsv, "csv", "CSV"},
};

std::size_t numBytesOf(const std::string& file) {
  std::error_code error;  // Another program may have removed the file.
  const auto num_bytes = std::filesystem::file_size(file, error);
  return error ? 0 : num_bytes;
}

/// @param is_octree_expected  Whether the file has the name of an octree.
MapFile decode(const std::string& bytes, bool is_octree_expected, const SensorModelConfig& model,
               const SnapshotLimits& limits) {
  if (bytes.empty()) throw MapFileError(MapFileDefect::kTruncated, "is empty");
  if (isOctomapFile(bytes)) {
    const bool is_binary = bytes.rfind("# Octomap OcTree binary", 0) == 0;
    return {is_binary ? MapFormat::kOctomapBinary : MapFormat::kOctomapFull,
            fromOctomapFile(bytes, model, limits), bytes.size()};
  }
  if (is_octree_expected) {
    throw MapFileError(MapFileDefect::kForeign,
                       "is not an OctoMap file: it does not begin with '# Octomap OcTree'");
  }
  return {MapFormat::kNative, fromNativeFormat(bytes, limits), bytes.size()};
}

/// The result of work that does not know the file whose name its errors shall begin with.
template <typename WorkT>
auto withName(const std::string& file, const WorkT& work) {
  try {
    return work();
  } catch (const MapFileError& error) {
    throw MapFileError(error.defect(), file + " " + error.what());
  }
}

void write(const std::string& file, const MapSnapshot& snapshot, MapFormat format,
           const ProgressListener& listener) {
  const auto write_points = [&](PointCloudFormat kind) {
    replaceFile(file, [&](const std::string& partial) {
      writePointCloud(partial, snapshot, kind, listener);
    });
  };
  const auto write_octree = [&](OctreeKind kind) {
    std::string bytes = withName(file, [&] { return toOctomapFile(snapshot, kind); });
    replaceFile(file, std::move(bytes));
  };
  switch (format) {
    case MapFormat::kNative: return replaceFile(file, toNativeFormat(snapshot, listener));
    case MapFormat::kStore: return writeStore(file, snapshot, listener);
    case MapFormat::kOctomapFull: return write_octree(OctreeKind::kFull);
    case MapFormat::kOctomapBinary: return write_octree(OctreeKind::kBinary);
    case MapFormat::kPcd: return write_points(PointCloudFormat::kPcd);
    case MapFormat::kPly: return write_points(PointCloudFormat::kPly);
    case MapFormat::kCsv: return replaceFile(file, toCsv(snapshot, listener));
  }
}

}  // namespace

const char* toString(MapFormat format) {
  return std::find_if(std::begin(kFormats), std::end(kFormats),
                      [format](const FormatName& name) { return name.format == format; })
      ->name;
}

std::optional<MapFormat> formatOfName(const std::string& file) {
  std::string ending = std::filesystem::path(file).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const FormatName& name : kFormats) {
    if (ending == std::string(".") + name.ending) return name.format;
  }
  return std::nullopt;
}

std::string knownEndings() {
  std::string endings;
  for (const FormatName& name : kFormats) {
    endings += (endings.empty() ? "." : ", .") + std::string(name.ending);
  }
  return endings;
}

MapFile readMapFile(const std::string& file, const SensorModelConfig& model,
                    const SnapshotLimits& limits) {
  const auto format = formatOfName(file);
  if (format == MapFormat::kStore || isSqliteFile(file)) {
    MapSnapshot snapshot = readStore(MapStore(file, StoreAccess::kRead), limits);
    return {MapFormat::kStore, std::move(snapshot), numBytesOf(file)};
  }
  const std::string bytes = readFile(file, limits.max_bytes);
  const bool is_octree_expected =
      format == MapFormat::kOctomapFull || format == MapFormat::kOctomapBinary;
  return withName(file, [&] { return decode(bytes, is_octree_expected, model, limits); });
}

std::size_t writeMapFile(const std::string& file, const MapSnapshot& snapshot,
                         const ProgressListener& listener) {
  const auto format = formatOfName(file);
  if (!format) {
    throw MapFileError(MapFileDefect::kForeign,
                       "cannot write " + file + ": its name must end in one of " + knownEndings());
  }
  write(file, snapshot, *format, listener);
  return numBytesOf(file);
}

CuboidMap loadMap(const std::string& file) {
  MapSnapshot snapshot = readMapFile(file).snapshot;
  MapConfig config;
  config.resolution_m = snapshot.resolution_m;
  config.sensor_model = snapshot.sensor_model;
  config.environment = snapshot.environment;
  CuboidMap map(config);
  restoreSnapshot(std::move(snapshot), map);
  return map;
}

ChangeSet loadMap(const std::string& file, CuboidMap& map) {
  MapSnapshot snapshot = readMapFile(file, map.config().sensor_model).snapshot;
  const double resolution_m = map.grid().resolution();
  if (snapshot.resolution_m != resolution_m) {
    throw MapFileError(MapFileDefect::kForeign,
                       file + " has voxels of " + toText(snapshot.resolution_m) +
                           " m, and the map of " + toText(resolution_m) +
                           " m: make the map with the resolution of the file");
  }
  return restoreSnapshot(std::move(snapshot), map);
}

std::size_t saveMap(const CuboidMap& map, const std::string& file, const std::string& frame_id) {
  return writeMapFile(file, takeSnapshot(map, frame_id));
}

}  // namespace cuboid_mapping
