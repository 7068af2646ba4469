// SPDX-License-Identifier: BSD-3-Clause
// Reads a map of octomap_server, or any other map file, queries it, and writes it as .cuboids.
//
// usage: from_bt MAP.bt [MAP.cuboids]
#include <cuboid_mapping/io/map_files.h>
#include <cuboid_mapping/map/cuboid_map.h>
#include <cuboid_mapping/query/cuboid_query.h>

#include <exception>
#include <iostream>
#include <stdexcept>

using namespace cuboid_mapping;

int main(int argc, char** argv) try {
  if (argc < 2) throw std::runtime_error("usage: from_bt MAP.bt [MAP.cuboids]");
  const MapFile file = readMapFile(argv[1]);  // The content decides the format.
  MapConfig config;
  config.resolution_m = file.snapshot.resolution_m;
  config.sensor_model = file.snapshot.sensor_model;
  CuboidMap map(config);
  restoreSnapshot(file.snapshot, map);

  std::cout << toString(file.format) << ", " << config.resolution_m << " m\n";
  const auto occupied =
      selectCuboids(map, kAllCells, {CuboidFilter::kOccupied}, Budget::unlimited());
  std::cout << map.voxels().numOccupiedVoxels() << " occupied voxels in " << occupied.value.size()
            << " cuboids\n";
  if (argc > 2) writeMapFile(argv[2], takeSnapshot(map, "map"));
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
