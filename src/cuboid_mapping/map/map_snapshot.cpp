// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/map_snapshot.h"

#include "cuboid_mapping/voxels/uniform_boxes.h"

#include <cmath>
#include <sstream>

namespace cuboid_mapping {
namespace {

template <typename... PartsT>
std::string concat(const PartsT&... parts) {
  std::ostringstream text;
  (text << ... << parts);
  return text.str();
}

std::string findFaultOfConfig(const MapSnapshot& snapshot) {
  if (!(snapshot.resolution_m >= 1e-3 && snapshot.resolution_m <= 1e2)) {
    return concat("resolution ", snapshot.resolution_m, " m: must be from 0.001 to 100 m");
  }
  const SensorModelConfig& model = snapshot.sensor_model;
  const auto is_between = [](double value, double lower, double upper) {
    return value > lower && value < upper;  // NaN fails it, too
  };
  if (!is_between(model.hit, 0.5, 1.0) || !is_between(model.alpha_max, 0.5, 1.0) ||
      !is_between(model.miss, 0.0, 0.5) || !is_between(model.alpha_min, 0.0, 0.5)) {
    return concat("sensor model hit ", model.hit, ", miss ", model.miss, ", min ", model.alpha_min,
                  ", max ", model.alpha_max, ": a value is out of its range");
  }
  return {};
}

std::string findFaultOfBrick(const VoxelBrick& brick) {
  if (brick.brick != brickOf(brick.brick) || !kAllCells.contains(brickBox(brick.brick))) {
    return concat("brick ", brick.brick, " reaches beyond the cells of a map");
  }
  if (brick.voxels.isEmpty()) return concat("brick ", brick.brick, " has no voxels");
  bool is_finite = true;
  brick.voxels.forEachValue([&](float log_odds, const BrickMask& /*voxels*/) {
    is_finite = is_finite && std::isfinite(log_odds);
  });
  return is_finite ? std::string() : concat("brick ", brick.brick, " has infinite log-odds");
}

}  // namespace

MapSnapshot takeSnapshot(const CuboidMap& map, const std::string& frame_id) {
  MapSnapshot snapshot{
      map.config().resolution_m, map.config().sensor_model, map.config().environment, frame_id, {}};
  snapshot.bricks.reserve(map.voxels().size());
  map.voxels().forEach([&](const VoxelBrick& brick) { snapshot.bricks.push_back(brick); });
  sortBricks(snapshot.bricks);
  return snapshot;
}

ChangeSet restoreSnapshot(const MapSnapshot& snapshot, CuboidMap& map) {
  ChangeSet changes = map.clear();
  changes.revision = map.replace(kAllCells, snapshot.bricks).revision;
  return changes;
}

std::optional<SnapshotFault> findFault(const MapSnapshot& snapshot, const SnapshotLimits& limits) {
  std::string fault = findFaultOfConfig(snapshot);
  if (fault.empty() && snapshot.bricks.size() > limits.max_bricks) {
    return SnapshotFault{
        true, concat("has ", snapshot.bricks.size(), " bricks of 8 x 8 x 8 voxels, more than ",
                     limits.max_bricks)};
  }
  const VoxelBrick* last = nullptr;
  for (const VoxelBrick& brick : snapshot.bricks) {
    if (!fault.empty()) break;
    fault = findFaultOfBrick(brick);
    if (last != nullptr && !isBeforeOnMortonCurve(last->brick, brick.brick)) {
      fault = concat("brick ", brick.brick, " comes twice, or not in its place");
    }
    last = &brick;
  }
  if (fault.empty()) return std::nullopt;
  return SnapshotFault{false, fault};
}

}  // namespace cuboid_mapping
