// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/scan/scan_update.h"

#include "support/voxel_map.h"

#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include <limits>

namespace cuboid_mapping::test {

constexpr double kNoLimit = std::numeric_limits<double>::infinity();

/// A scan from the middle of voxel (0 0 0) at 1 m.
inline Scan scanFromVoxelZero() {
  Scan scan;
  scan.origin = {0.5F, 0.5F, 0.5F};
  return scan;
}

inline ObservedCells observe(const Scan& scan, double max_range_m = kNoLimit) {
  ScanUpdater updater(Grid(1.0), max_range_m);
  return toObservedCells(updater.compute(scan));
}

/// The update as octomap_server's OctomapServer::insertScan computes it, with OctoMap's ray walk.
inline ObservedCells observeWithOctomap(const Scan& scan, double resolution_m, double max_range_m) {
  const octomap::OcTree tree(resolution_m);
  octomap::KeyRay keys;
  ObservedCells cells;
  const octomap::point3d origin(scan.origin.x(), scan.origin.y(), scan.origin.z());
  const auto mark = [&](const octomap::OcTreeKey& key, bool is_hit) {
    bool& was_hit = cells[{key[0] - 32768, key[1] - 32768, key[2] - 32768}];
    was_hit = was_hit || is_hit;
  };
  const auto addBeam = [&](const Eigen::Vector3f& point, bool is_return, bool is_open = false) {
    octomap::point3d end(point.x(), point.y(), point.z());
    const bool is_cut = (end - origin).norm() > max_range_m;
    if (is_cut) end = origin + (end - origin).normalized() * static_cast<float>(max_range_m);
    EXPECT_TRUE(tree.computeRayKeys(origin, end, keys));
    for (const octomap::OcTreeKey& key : keys) mark(key, false);
    if (!is_open || is_cut) mark(tree.coordToKey(end), is_return && !is_cut);
  };
  for (const Eigen::Vector3f& point : scan.points) addBeam(point, true);
  for (const Eigen::Vector3f& end : scan.no_returns) addBeam(end, false);
  for (const Eigen::Vector3f& end : scan.open_ends) addBeam(end, false, true);
  return cells;
}

}  // namespace cuboid_mapping::test
