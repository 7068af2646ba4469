// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/point_query.h"

#include "cuboid_mapping/map/cuboid_search.h"

namespace cuboid_mapping {

std::optional<Cuboid> findCuboidOfCell(const CuboidMap& map, const Cell& cell) {
  std::optional<Cuboid> found;
  visitBox(map, CellBox::ofCell(cell), CuboidFilter::kAll, [&found](const Cuboid& cuboid) {
    found = cuboid;
    return Visit::kStop;
  });
  return found;
}

std::optional<Cuboid> findCuboid(const CuboidMap& map, const Eigen::Vector3d& point_map) {
  const auto cell = map.grid().toCell(point_map);
  return cell ? findCuboidOfCell(map, *cell) : std::nullopt;
}

Occupancy classifyPoint(const CuboidMap& map, const Eigen::Vector3d& point_map) {
  const auto cell = map.grid().toCell(point_map);
  return cell ? map.voxels().at(*cell) : Occupancy::kUnknown;
}

}  // namespace cuboid_mapping
