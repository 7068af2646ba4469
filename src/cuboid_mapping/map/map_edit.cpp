// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/map_edit.h"

#include <stdexcept>

namespace cuboid_mapping {
namespace {

CellBox toCellBox(const CuboidMap& map, const MetricBox& box_map) {
  const auto box = map.grid().toCellBox(box_map);
  if (!box) {
    throw std::invalid_argument(
        "the box is flat, not finite, or reaches beyond the grid: give finite corners in metres, "
        "with "
        "max greater than min on every axis");
  }
  return *box;
}

}  // namespace

ChangeSet fill(CuboidMap& map, const MetricBox& box_map, Occupancy occupancy) {
  if (occupancy == Occupancy::kUnknown) return forget(map, box_map);
  const CellBox box = toCellBox(map, box_map);
  const SensorModel& model = map.sensorModel();
  const float log_odds = occupancy == Occupancy::kOccupied ? model.max() : model.min();
  return map.replace(box, {UniformBox{box, log_odds}});
}

ChangeSet forget(CuboidMap& map, const MetricBox& box_map) {
  return map.replace(toCellBox(map, box_map), std::vector<UniformBox>());
}

}  // namespace cuboid_mapping
