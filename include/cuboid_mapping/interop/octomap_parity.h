// SPDX-License-Identifier: BSD-3-Clause
// OctoMap as oracle and peer of the map.
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/scan/scan.h"

#include <octomap/OcTree.h>

namespace cuboid_mapping {

/// An empty OctoMap with the resolution and the sensor model of a map.
[[nodiscard]] octomap::OcTree makeOctomap(const MapConfig& config);

/// Inserts a scan as octomap_server does.
///
/// Without a max range: octomap::OcTree::insertPointCloud, not discretized, not lazy. With one, it also updates
/// the voxel where a beam is cut as a miss, as octomap_server's insertScan does.
///
/// @pre scan.anchor_map is zero, and the scan has points only: OctoMap has nothing else.
/// @param max_range_m  Infinity for no limit.
void insertIntoOctomap(const Scan& scan, double max_range_m, octomap::OcTree& tree);

/// Agreement of two maps, voxel by voxel.
struct Agreement {
  double voxels = 0.0;                   ///< Voxels known to OctoMap.
  double known_mismatch = 0.0;           ///< Voxels known to one map only.
  double class_mismatch = 0.0;           ///< Voxels free in one map and occupied in the other.
  double max_log_odds_difference = 0.0;  ///< Maximum over all voxels known to both.

  /// Whether known voxels and classes agree exactly, and log-odds within 1e-3.
  [[nodiscard]] bool isExact() const {
    return known_mismatch == 0.0 && class_mismatch == 0.0 && max_log_odds_difference <= 1e-3;
  }
};

/// Compares every voxel that is known to either map. @complexity O(n log n).
[[nodiscard]] Agreement compareWithOctomap(const CuboidMap& map, const octomap::OcTree& tree);

}  // namespace cuboid_mapping
