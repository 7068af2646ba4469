// SPDX-License-Identifier: BSD-3-Clause
// Our voxels of each cloud, one by one, for maps that are filled with them.
#pragma once

#include "timing.h"

#include "cuboid_mapping/scan/scan_update.h"

#include <memory>

namespace cuboid_mapping::bench {

class OurVoxels {
 public:
  OurVoxels(const Grid& grid, double max_range_m)
      : updater_(std::make_unique<ScanUpdater>(grid, max_range_m)) {}

  /// Valid until the next call.
  [[nodiscard]] const ScanUpdate& compute(const Scan& scan) {
    const ScanUpdate* update = nullptr;
    ray_walk_cpu_s_ += timeOf([&] { update = &updater_->compute(scan); }).cpu_s;
    return *update;
  }

  /// @param miss, hit  (const Cell&): each voxel once, a hit where it is both.
  template <typename MissT, typename HitT>
  static void forEach(const ScanUpdate& update, MissT miss, HitT hit) {
    for (const BrickUpdate& brick : update.bricks) {
      forEachCell(brick.brick, brick.misses.without(brick.hits), miss);
      forEachCell(brick.brick, brick.hits, hit);
    }
  }

  /// Frees the memory of the ray walk; nothing can be computed afterwards.
  void drop() { updater_.reset(); }
  [[nodiscard]] double rayWalkCpu_s() const { return ray_walk_cpu_s_; }

 private:
  std::unique_ptr<ScanUpdater> updater_;
  double ray_walk_cpu_s_ = 0.0;
};

}  // namespace cuboid_mapping::bench
