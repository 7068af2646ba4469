// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/scan/scan_update.h"
#include "data_sets/scan_dataset.h"

#include <string>
#include <vector>

namespace cuboid_mapping::bench {

/// The map of a data set, and where its sensor was.
struct MappedScans {
  CuboidMap map;
  std::vector<Eigen::Vector3d> places_map;
};

/// @param dataset  A folder of scans, or a .graph file. @throws As openScanDataset().
inline MappedScans mapScans(const std::string& dataset, double resolution_m) {
  MapConfig config;
  config.resolution_m = resolution_m;
  MappedScans mapped{CuboidMap(config), {}};
  ScanUpdater updater(mapped.map.grid());
  const auto scans = openScanDataset(dataset);
  for (std::size_t i = 0; i < scans->size(); ++i) {
    const ScanDataset::Item item = scans->read(i);
    const Eigen::Vector3d origin = item.T_map_sensor.translation();
    mapped.map.apply(updater.compute(makeScan(item.T_map_sensor, origin, item.points_sensor)));
    mapped.places_map.push_back(origin);
  }
  return mapped;
}

}  // namespace cuboid_mapping::bench
