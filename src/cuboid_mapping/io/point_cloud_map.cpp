// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/point_cloud_map.h"

#include "cuboid_mapping/geometry/grid.h"
#include "cuboid_mapping/io/pcd_file.h"
#include "cuboid_mapping/voxels/uniform_boxes.h"

#include <stdexcept>

namespace cuboid_mapping {

MapSnapshot readPointCloudMap(const std::string& file, double resolution_m,
                              const SensorModelConfig& model) {
  const Grid grid(resolution_m);
  const float log_odds = SensorModel(model, Environment::kDynamic).max();
  std::vector<UniformBox> boxes;
  for (const Eigen::Vector3d& point : readPcd(file).points) {
    const auto cell = point.allFinite() ? grid.toCell(point) : std::nullopt;
    if (cell) boxes.push_back({CellBox::ofCell(*cell), log_odds});
  }
  if (boxes.empty()) throw std::runtime_error(file + " has no point that a map can hold");
  MapSnapshot snapshot;
  snapshot.resolution_m = resolution_m;
  snapshot.sensor_model = model;
  snapshot.bricks = toBricks(boxes).bricks;
  return snapshot;
}

void cuboid_mapping_read_point_cloud_map(const std::string& file, double resolution_m,
                                         const SensorModelConfig& model, MapSnapshot& snapshot) {
  snapshot = readPointCloudMap(file, resolution_m, model);
}

}  // namespace cuboid_mapping
