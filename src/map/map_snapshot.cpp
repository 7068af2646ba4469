// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/map_snapshot.h"

#include "cuboid_mapping/rtree/traversal.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <unordered_map>

namespace cuboid_mapping {
namespace {

template <typename... PartsT>
std::string concat(const PartsT&... parts) {
  std::ostringstream text;
  (text << ... << parts);
  return text.str();
}

/// Bricks that a box touches. Exact up to 2^53.
double numBricks(const CellBox& box) {
  double count = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    count *= static_cast<double>(((box.max[axis] - 1) >> 3) - (box.min[axis] >> 3) + 1);
  }
  return count;
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

std::string findFaultOfCuboid(const Cuboid& cuboid) {
  if (cuboid.box.isEmpty() || !kAllCells.contains(cuboid.box)) {
    return concat("cuboid ", cuboid.box, " is empty, or reaches beyond the cells of a map");
  }
  if (!std::isfinite(cuboid.log_odds)) {
    return concat("cuboid ", cuboid.box, " has log-odds ", cuboid.log_odds);
  }
  return {};
}

using BrickMasks = std::unordered_map<Cell, BrickMask, CellHash>;

/// The cuboids, divided anew in every brick; as they are, where the strategy looks beyond bricks.
std::vector<Cuboid> fuseBricks(const std::vector<Cuboid>& cuboids, const std::string& fusion,
                               const ProgressListener& listener) {
  const auto strategy = makeFusion(fusion);
  if (strategy == nullptr) return cuboids;
  std::unordered_map<Cell, std::vector<std::uint32_t>, CellHash> members;
  for (std::uint32_t i = 0; i < cuboids.size(); ++i) {
    (void)anyBrick(cuboids[i].box, [&](const Cell& brick) {
      members[brick].push_back(i);
      return false;  // on to the next
    });
  }
  std::vector<Cuboid> fused;
  ProgressCounter progress(listener, members.size());
  for (const auto& [brick, indices] : members) {
    DenseBrick dense;
    dense.brick = brick;
    for (const std::uint32_t i : indices) dense.fill(cuboids[i]);
    strategy->partition(dense, fused);
    progress.advance();
  }
  return fused;
}

/// @return Whether a voxel of the part was taken already.
bool take(const CellBox& part, BrickMask& mask) {
  const std::uint64_t slice = sliceMask(part);
  bool is_taken = false;
  for (std::int32_t z = part.min.z; z < part.max.z; ++z) {
    std::uint64_t& word = mask[static_cast<std::size_t>(z & 7)];
    is_taken |= (word & slice) != 0;
    word |= slice;
  }
  return is_taken;
}

}  // namespace

MapSnapshot takeSnapshot(const CuboidMap& map, const std::string& frame_id) {
  MapSnapshot snapshot{
      map.config().resolution_m, map.config().sensor_model, map.config().environment, frame_id, {}};
  snapshot.cuboids.reserve(map.tree().size());
  visitAll(map.tree(), CuboidFilter::kAll, [&snapshot](const Cuboid& cuboid) {
    snapshot.cuboids.push_back(cuboid);
    return Visit::kContinue;
  });
  return snapshot;
}

std::vector<Cuboid> fuseSnapshot(const MapSnapshot& snapshot, const SensorModel& thresholds,
                                 const std::string& fusion, const ProgressListener& listener) {
  std::vector<Cuboid> cuboids = snapshot.cuboids;
  for (Cuboid& cuboid : cuboids) {
    cuboid.log_odds = std::clamp(cuboid.log_odds, thresholds.min(), thresholds.max());
  }
  return fuseBricks(cuboids, fusion, listener);
}

ChangeSet restoreSnapshot(const MapSnapshot& snapshot, CuboidMap& map) {
  const auto cuboids = fuseSnapshot(snapshot, map.sensorModel(), map.config().fusion);
  ChangeSet changes = map.clear();
  changes.revision = map.replace(kAllCells, cuboids).revision;
  return changes;
}

void sortCuboids(std::vector<Cuboid>& cuboids) {
  std::sort(cuboids.begin(), cuboids.end(), [](const Cuboid& a, const Cuboid& b) {
    const Cell brick_a = brickOf(a.box.min);
    const Cell brick_b = brickOf(b.box.min);
    return brick_a == brick_b ? a.box.min < b.box.min : isBeforeOnMortonCurve(brick_a, brick_b);
  });
}

std::optional<SnapshotFault> findFault(const MapSnapshot& snapshot, const SnapshotLimits& limits) {
  std::string fault = findFaultOfConfig(snapshot);
  double num_bricks = 0.0;
  for (const Cuboid& cuboid : snapshot.cuboids) {
    if (fault.empty()) fault = findFaultOfCuboid(cuboid);
    if (!fault.empty()) break;
    num_bricks += numBricks(cuboid.box) - 1.0;  // small ones share theirs: these are counted below
  }
  if (!fault.empty()) return SnapshotFault{false, fault};
  const std::string limit = concat(", more than ", limits.max_bricks);
  if (num_bricks > static_cast<double>(limits.max_bricks)) {
    return SnapshotFault{true, concat("fills ", num_bricks, " bricks of 8 x 8 x 8 voxels", limit)};
  }
  BrickMasks masks;
  for (const Cuboid& cuboid : snapshot.cuboids) {
    const bool is_taken = anyBrick(cuboid.box, [&](const Cell& brick) {
      return take(intersect(cuboid.box, brickBox(brick)), masks[brick]);
    });
    if (is_taken) {
      return SnapshotFault{false, concat("cuboid ", cuboid.box, " shares cells with another one")};
    }
    if (masks.size() > limits.max_bricks) {
      return SnapshotFault{true, concat("fills bricks of 8 x 8 x 8 voxels", limit)};
    }
  }
  return std::nullopt;
}

}  // namespace cuboid_mapping
