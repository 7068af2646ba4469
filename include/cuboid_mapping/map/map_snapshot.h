// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/map/progress_listener.h"

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping {

/// What a map holds at one time, apart from the map: what files are written from and read into.
struct MapSnapshot {
  double resolution_m = 0.05;
  SensorModelConfig sensor_model;
  Environment environment = Environment::kDynamic;
  std::string frame_id;         ///< Of the map; empty where a file does not say it.
  std::vector<Cuboid> cuboids;  ///< Disjoint, in no particular order.
};

/// How much a snapshot from outside may hold, so that a damaged file does not take all memory.
struct SnapshotLimits {
  /// Bricks of 8 x 8 x 8 voxels that cuboids touch. The default stands for some gigabytes of map.
  std::size_t max_bricks = std::size_t{1} << 26;
};

/// Everything in the R-tree of a map. Flush the map first. @complexity O(n).
[[nodiscard]] MapSnapshot takeSnapshot(const CuboidMap& map, const std::string& frame_id);

/// The cuboids of a snapshot, fused anew in each brick as a strategy does (not by `growth`, which
/// takes them as they are); log-odds beyond clamping thresholds become these.
/// @param fusion  One of fusionNames(). @param listener  Is told of bricks.
/// @pre findFault() finds none. @complexity O(n) for cuboids and bricks that they touch.
[[nodiscard]] std::vector<Cuboid> fuseSnapshot(const MapSnapshot& snapshot,
                                               const SensorModel& thresholds,
                                               const std::string& fusion,
                                               const ProgressListener& listener = {});

/// Puts a snapshot in the place of everything in a map, fused by fuseSnapshot() as the map's
/// strategy does. The revision rises.
/// @pre findFault() finds none, and the resolutions are equal.
/// @complexity O(n log n) for cuboids and bricks that they touch.
ChangeSet restoreSnapshot(const MapSnapshot& snapshot, CuboidMap& map);

/// Sorts the cuboids by brick, bricks along the Morton curve, then by least cell: equal maps become
/// equal snapshots.
void sortCuboids(std::vector<Cuboid>& cuboids);

/// Why a snapshot cannot be a map.
struct SnapshotFault {
  bool is_too_big;  ///< It is more than the limits allow; else it is wrong in itself.
  std::string text;
};

/// Why a snapshot cannot be a map; nothing when it can.
///
/// The first of these: a resolution outside 1e-3 to 1e2 m; a sensor model with a value outside its
/// range; a cuboid that is empty, or reaches outside kAllCells; a log-odds that is NaN or infinite;
/// more bricks than the limit; cuboids that share a cell.
/// @complexity O(cuboids and bricks that they touch).
[[nodiscard]] std::optional<SnapshotFault> findFault(const MapSnapshot& snapshot,
                                                     const SnapshotLimits& limits = {});

}  // namespace cuboid_mapping
