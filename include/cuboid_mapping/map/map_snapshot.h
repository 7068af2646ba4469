// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping {

/// A copy of a map's content at one time. Files are written from it and read into it.
struct MapSnapshot {
  double resolution_m = 0.05;                       ///< Edge of a voxel.
  SensorModelConfig sensor_model;                   ///< Sensor model of the map.
  Environment environment = Environment::kDynamic;  ///< Environment of the map.
  std::string frame_id;                             ///< Frame of the map; empty: the file has none.
  std::vector<VoxelBrick> bricks;  ///< Along the Morton curve, each once and with a known voxel.
  /// State of the program that makes the map, to go on with it; only a store (.sqlite) keeps it.
  std::string progress = {};
  /// Result of CuboidMap::lockedBoxes(); only the native format (.cuboids) keeps it.
  std::vector<CellBox> locked = {};
  /// Fused cuboids of FusionKind::kGrowth, which do not follow from the classes of the voxels: .cuboids and .sqlite keep
  /// them.
  std::vector<Cuboid> cuboids = {};
  /// Fusion of the map; kClass after reading a file.
  FusionKind fusion = FusionKind::kClass;
};

/// Limits for reading a snapshot, so that a damaged file does not take all memory.
struct SnapshotLimits {
  std::size_t max_bricks = std::size_t{1} << 24;     ///< Bricks of 8 x 8 x 8 voxels.
  std::uint64_t max_bytes = std::uint64_t{1} << 30;  ///< Limit of a file, both packed and unpacked.

  /// Limits with which reading takes about this much memory at most. The default limits are those of 4 GB.
  [[nodiscard]] static SnapshotLimits ofMemory(std::uint64_t bytes) {
    return {static_cast<std::size_t>(bytes / 256), bytes / 4};
  }
  /// No limits, for files of one's own.
  [[nodiscard]] static constexpr SnapshotLimits none() {
    return {std::numeric_limits<std::size_t>::max() / 8,
            std::numeric_limits<std::uint64_t>::max() / 8};
  }
};

/// All voxels of a map, its locks, and its fused cuboids of FusionKind::kGrowth. @complexity O(n log n).
[[nodiscard]] MapSnapshot takeSnapshot(const CuboidMap& map, const std::string& frame_id);

/// Replaces all voxels, cuboids and locks of a map by those of a snapshot, exactly. The revision rises.
/// A map with FusionKind::kGrowth gets the snapshot's cuboids, if it has some or is of such a map; else the voxels are
/// fused anew, brick by brick. @pre findFault() finds none.
/// @throws std::invalid_argument  The resolutions differ. @throws std::bad_alloc  In both cases the map is as
///         before.
/// @complexity O(n log n).
ChangeSet restoreSnapshot(MapSnapshot snapshot, CuboidMap& map);

/// A map of its own with the same configuration, voxels, locks, and cuboids; its revision starts anew. Bricks are
/// copied, and divided when they are read. @complexity O(n log n).
[[nodiscard]] CuboidMap copyOf(const CuboidMap& map);

/// Defect of a brick; empty if there is none. A brick must lie in kAllCells, at multiples of kBrickEdge, and
/// its log-odds must be finite.
[[nodiscard]] std::string findFault(const VoxelBrick& brick);

/// Defect of a snapshot.
struct SnapshotFault {
  bool is_too_big;   ///< The snapshot exceeds the limits; else it is invalid.
  std::string text;  ///< Description of the defect, for a message.
};

/// First defect of a snapshot; nothing if there is none.
///
/// Defects are: errors that checkConfig() finds in resolution, sensor model and environment; more
/// bricks than the limit; a brick that comes twice or not in order, without a known voxel, outside
/// kAllCells, or with a log-odds that is NaN or infinite; a locked box or a cuboid that is empty, outside kAllCells, or
/// shares a cell with another one. @complexity O(n log n).
[[nodiscard]] std::optional<SnapshotFault> findFault(const MapSnapshot& snapshot,
                                                     const SnapshotLimits& limits = {});

}  // namespace cuboid_mapping
