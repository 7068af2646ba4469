// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/map_snapshot.h"

#include "cuboid_mapping/fusion/cuboid_tree.h"
#include "cuboid_mapping/map/locked_boxes.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace cuboid_mapping {
namespace {

template <typename... PartsT>
std::string concat(const PartsT&... parts) {
  std::ostringstream text;
  (text << ... << parts);
  return text.str();
}

std::string findFaultOfConfig(const MapSnapshot& snapshot) {
  MapConfig config;
  config.resolution_m = snapshot.resolution_m;
  config.sensor_model = snapshot.sensor_model;
  config.environment = snapshot.environment;
  const std::vector<ConfigError> errors = checkConfig(config);
  return errors.empty() ? std::string() : errors.front().field + ' ' + errors.front().message;
}

/// @param name  Name of the boxes, for a message.
std::string findFaultOfBoxes(const char* name, const std::vector<CellBox>& boxes) {
  LockedBoxes disjoint;
  for (const CellBox& box : boxes) {
    if (box.isEmpty() || !kAllCells.contains(box)) {
      return concat(name, ' ', box, " is empty, or reaches beyond the limits of a map");
    }
    if (disjoint.intersects(box)) return concat(name, ' ', box, " shares voxels with another one");
    disjoint.add(box);
  }
  return {};
}

std::vector<CellBox> boxesOf(const std::vector<Cuboid>& cuboids) {
  std::vector<CellBox> boxes;
  boxes.reserve(cuboids.size());
  for (const Cuboid& cuboid : cuboids) boxes.push_back(cuboid.box);
  return boxes;
}

}  // namespace

MapSnapshot takeSnapshot(const CuboidMap& map, const std::string& frame_id) {
  MapSnapshot snapshot{map.config().resolution_m, map.config().sensor_model,
                       map.config().environment, frame_id, map.voxels().copyIn(kAllCells)};
  snapshot.locked = map.lockedBoxes();
  snapshot.fusion = map.config().fusion;
  if (const GrownBricks* grown = map.cuboids().grown()) {
    grown->forEach([&snapshot](const GrownBrick& brick) {
      for (const Cuboid& cuboid : brick.cuboids) {
        if (brickOf(cuboid.box.min) == brick.brick) snapshot.cuboids.push_back(cuboid);
      }
    });
    std::sort(snapshot.cuboids.begin(), snapshot.cuboids.end(),
              [](const Cuboid& a, const Cuboid& b) { return a.box.min < b.box.min; });
  }
  return snapshot;
}

ChangeSet restoreSnapshot(MapSnapshot snapshot, CuboidMap& map) {
  if (snapshot.resolution_m != map.config().resolution_m) {
    throw std::invalid_argument(
        "the snapshot has another resolution than the map: make the map with that of the snapshot");
  }
  CuboidMap restored(map.config());
  restored.replace(std::move(snapshot.bricks));
  if (snapshot.fusion == FusionKind::kGrowth || !snapshot.cuboids.empty()) {
    restored.setGrownCuboids(snapshot.cuboids);
  }
  map.setLocked(snapshot.locked);  // Nothing throws after this.
  return map.exchange(restored);
}

CuboidMap copyOf(const CuboidMap& map) {
  CuboidMap copy(map.config());
  restoreSnapshot(takeSnapshot(map, {}), copy);
  return copy;
}

std::string findFault(const VoxelBrick& brick) {
  if (brick.brick != brickOf(brick.brick) || !kAllCells.contains(brick.brick)) {
    return concat("brick ", brick.brick,
                  " is not at multiples of 8, or reaches beyond the limits of a map");
  }
  return brick.voxels.isFinite()
             ? std::string()
             : concat("brick ", brick.brick, " has log-odds that are not finite");
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
    fault = findFault(brick);
    if (brick.voxels.isEmpty()) fault = concat("brick ", brick.brick, " has no voxels");
    if (last != nullptr && !isBeforeOnMortonCurve(last->brick, brick.brick)) {
      fault = concat("brick ", brick.brick, " appears twice or out of order");
    }
    last = &brick;
  }
  if (fault.empty()) fault = findFaultOfBoxes("locked box", snapshot.locked);
  if (fault.empty()) fault = findFaultOfBoxes("cuboid", boxesOf(snapshot.cuboids));
  if (fault.empty()) return std::nullopt;
  return SnapshotFault{false, fault};
}

}  // namespace cuboid_mapping
