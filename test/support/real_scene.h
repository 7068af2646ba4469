// SPDX-License-Identifier: BSD-3-Clause
// Maps of real scans in CUBOID_DATA_DIR.
#pragma once

#include "cuboid_mapping/scan/scan_update.h"
#include "data_sets/scan_dataset.h"
#include "support/dense_obstacles.h"

#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping::test {

/// A map, and the place of its sensor.
struct Scene {
  CuboidMap map;
  std::vector<Eigen::Vector3d> poses_map;
};

/// Reads a scene; nothing if CUBOID_DATA_DIR is not set.
inline std::optional<Scene> readScene(const std::string& name, double resolution_m) {
  const char* folder = std::getenv("CUBOID_DATA_DIR");
  if (folder == nullptr) return std::nullopt;
  MapConfig config;
  config.resolution_m = resolution_m;
  Scene scene{CuboidMap(config), {}};
  ScanUpdater updater(scene.map.grid());
  const auto dataset = openScanDataset(std::string(folder) + "/" + name);
  for (std::size_t i = 0; i < dataset->size(); ++i) {
    const ScanDataset::Item item = dataset->read(i);
    const Eigen::Vector3d origin = item.T_map_sensor.translation();
    scene.map.apply(updater.compute(makeScan(item.T_map_sensor, origin, item.points_sensor)));
    scene.poses_map.push_back(origin);
  }
  return scene;
}

inline DenseObstacles makeObstacles(const CuboidMap& map, const CellBox& area,
                                    UnknownPolicy policy) {
  return {[&map](const Cell& cell) { return map.voxels().at(cell); }, area, policy};
}

}  // namespace cuboid_mapping::test
