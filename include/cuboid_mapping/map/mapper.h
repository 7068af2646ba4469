// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/parallel/parallel_for.h"
#include "cuboid_mapping/scan/scan.h"
#include "cuboid_mapping/scan/scan_update.h"

#include <limits>

namespace cuboid_mapping {

/// Parameters of a Mapper.
struct MapperConfig {
  MapConfig map;  ///< Of the map that the scans go into.
  /// Longer beams are cut there, and free the space up to it: > 0.
  double max_range_m = std::numeric_limits<double>::infinity();
};

/// Scans in, map out: the way into the library.
///
/// With map.threads > 1, a scan is put into the map beside the ray walk of the next one; the map does
/// not depend on it. Not thread-safe: map() and integrate() belong to one thread.
class Mapper {
 public:
  /// @throws std::invalid_argument  with everything that checkConfig() finds.
  explicit Mapper(const MapperConfig& config = {})
      : map_(checked(config).map),
        updater_(map_.grid(), config.max_range_m, config.map.threads, config.map.beamSampling()) {}
  Mapper(const Mapper&) = delete;
  Mapper& operator=(const Mapper&) = delete;

  /// Takes one scan: every voxel that its beams pass or end in is observed once.
  /// @throws std::bad_alloc  of this scan, or of the one before while it was put into the map.
  void integrate(const Scan& scan) {
    updater_.compute(scan);  // The ray walk, which does not see the map.
    finish();
    updater_.swapUpdate(update_);
    const auto apply = [this] { map_.apply(update_); };
    if (map_.config().threads > 1) {
      applying_ = BackgroundWork(apply);
    } else {
      apply();
    }
  }

  /// The map with all scans, for queries (query/), edits and files (io/).
  [[nodiscard]] CuboidMap& map() {
    finish();
    return map_;
  }

  /// What the last scan was: how many points took part, and how many could not.
  [[nodiscard]] const ScanUpdate& lastUpdate() const { return update_; }

 private:
  void finish() { applying_.wait(); }

  CuboidMap map_;
  ScanUpdater updater_;
  ScanUpdate update_;        ///< Of the scan that is put into the map.
  BackgroundWork applying_;  ///< Last: it ends before what it works with goes.
};

}  // namespace cuboid_mapping
