// SPDX-License-Identifier: BSD-3-Clause
// Puts kept clouds into a map, one after the other.
#pragma once

#include "cuboid_mapping/history/brick_region.h"
#include "cuboid_mapping/history/map_history.h"
#include "cuboid_mapping/parallel/parallel_for.h"
#include "cuboid_mapping/scan/scan_update.h"

#include <map>
#include <vector>

namespace cuboid_mapping {

/// Scans where the body is, without the points that the limits leave out. @param counts  Gets these.
[[nodiscard]] std::vector<Scan> placeScans(const Eigen::Isometry3d& T_map_body,
                                           const std::vector<Scan>& scans_body,
                                           const ScanLimits& limits, FilterCounts& counts);

/// Puts clouds into a map: with several threads, beside the ray walk of the next one.
class CloudReplay {
 public:
  /// @param map  Must outlive this object, and is to be read after settle() only.
  explicit CloudReplay(CuboidMap& map) : map_(map) {}

  /// What a cloud says. Does not see the map. @param config  Stays where it is as long as this object lives.
  /// @param region  Where not null, all that it says about these bricks. @return Valid until the next call.
  const ScanUpdate& walk(const std::vector<Scan>& scans_body, const Eigen::Isometry3d& T_map_body,
                         const ObservationConfig& config, const BrickRegion* region = nullptr);
  /// Puts a cloud into the map. @param region  Where not null, nothing else changes than these bricks.
  void put(const std::vector<Scan>& scans_body, const Eigen::Isometry3d& T_map_body,
           const ObservationConfig& config, const BrickRegion* region = nullptr);
  /// Waits for the last cloud.
  void settle() { applying_.wait(); }

 private:
  ScanUpdater& updaterOf(const ObservationConfig& config);

  CuboidMap& map_;
  std::map<const ObservationConfig*, ScanUpdater> updaters_;
  ScanUpdate update_;
  BackgroundWork applying_;  ///< Last: it ends before what it works with goes.
};

}  // namespace cuboid_mapping
