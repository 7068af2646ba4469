// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/map_storage.h"

#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/ros/tf_lookup.h"

#include <cmath>
#include <exception>
#include <sstream>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::CuboidMap;
using cuboid_mapping::MapFile;
using cuboid_mapping::MapSnapshot;

/// Runs work that may throw; its exceptions become errors of the answer.
template <typename WorkT>
StorageAnswer guard(const WorkT& work) {
  StorageAnswer answer;
  try {
    work(answer);
  } catch (const std::bad_alloc&) {
    answer.error = "there is not enough memory";
  } catch (const std::exception& exception) {
    answer.error = exception.what();
  }
  return answer;
}

std::string compareResolutions(double of_file_m, double of_map_m, const std::string& file) {
  if (std::abs(of_file_m - of_map_m) <= 1e-9 * of_map_m) return {};
  std::ostringstream text;
  text << file << " has voxels of " << of_file_m << " m, and this map of " << of_map_m
       << " m: start the node with resolution " << of_file_m << ", or with map_file";
  return text.str();
}

}  // namespace

StorageAnswer saveMap(GuardedMap& map, const std::string& frame_id, const std::string& file) {
  return guard([&](StorageAnswer& answer) {
    MapSnapshot snapshot;
    map.read([&](const CuboidMap& content, const ros::Time& /*stamp*/) {
      snapshot = takeSnapshot(content, withoutSlash(frame_id));
      answer.revision = content.revision();
      answer.num_cuboids = countCuboids(content).total();
      return 0;
    });
    answer.num_bytes = writeMapFile(file, snapshot);
  });
}

StorageAnswer loadMap(GuardedMap& map, const std::string& file) {
  return guard([&](StorageAnswer& answer) {
    const auto model = map.read([](const CuboidMap& content, const ros::Time& /*stamp*/) {
      return content.config().sensor_model;
    });
    const MapFile read = cuboid_mapping::readMapFile(file, model);
    answer.error = compareResolutions(read.snapshot.resolution_m, map.grid().resolution(), file);
    if (!answer.error.empty()) return;
    map.edit([&](CuboidMap& content, const ros::Time& /*stamp*/) {
      cuboid_mapping::ChangeSet changes = restoreSnapshot(read.snapshot, content);
      answer.num_cuboids = countCuboids(content).total();
      return changes;
    });
    answer.num_bytes = read.num_bytes;
  });
}

std::optional<MapSnapshot> readStartMap(NodeParameters& parameters) {
  if (parameters.map_file.empty()) return std::nullopt;
  MapFile file = cuboid_mapping::readMapFile(parameters.map_file, parameters.map.sensor_model);
  parameters.map.resolution_m = file.snapshot.resolution_m;
  return std::move(file.snapshot);
}

}  // namespace cuboid_mapping_ros
