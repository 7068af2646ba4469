// SPDX-License-Identifier: BSD-3-Clause
// Puts kept clouds into a map, one after the other.
#pragma once

#include "cuboid_mapping/history/map_history.h"
#include "cuboid_mapping/parallel/parallel_for.h"
#include "cuboid_mapping/scan/scan_update.h"

#include <map>
#include <vector>

namespace cuboid_mapping {

/// Scans placed by the body's pose, without points outside the limits. @param counts  Counts these points.
[[nodiscard]] std::vector<Scan> placeScans(const Eigen::Isometry3d& T_map_body,
                                           const std::vector<Scan>& scans_body,
                                           const ScanLimits& limits, FilterCounts& counts);

/// Puts clouds into a map; with several threads, beside the ray walk of the next cloud.
class CloudReplay {
 public:
  /// @param map  Must outlive this object. Read it only after wait().
  explicit CloudReplay(CuboidMap& map) : map_(map) {}

  /// Puts a cloud into the map. @param config  Must not move while this object lives.
  void put(const std::vector<Scan>& scans_body, const Eigen::Isometry3d& T_map_body,
           const ObservationConfig& config);
  /// Waits for the last cloud.
  void wait() { applying_.wait(); }

 private:
  void setThresholds(const SensorModelConfig& of_cloud);

  CuboidMap& map_;
  std::map<const ObservationConfig*, ScanUpdater> updaters_;
  ScanUpdate update_;
  BackgroundWork applying_;  ///< Last member: it ends before the others are destroyed.
};

}  // namespace cuboid_mapping
