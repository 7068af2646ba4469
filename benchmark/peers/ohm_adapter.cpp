// SPDX-License-Identifier: BSD-3-Clause
#include "peers/ohm_map.h"
#include "timing.h"

#include "cuboid_mapping/scan/scan_update.h"

namespace cuboid_mapping::bench {
namespace {

/// Filled voxel by voxel with our update of each cloud.
class OhmVoxelAdapter : public OhmAdapter {
 public:
  explicit OhmVoxelAdapter(const InsertionConfig& config)
      : OhmAdapter(config.map),
        updater_(std::make_unique<ScanUpdater>(Grid(config.map.resolution_m), config.max_range_m)) {
  }

  [[nodiscard]] std::string name() const override { return "ohm"; }

  void insert(const Scan& scan) override {
    const ScanUpdate* update = nullptr;
    ray_walk_cpu_s_ += timeOf([&] { update = &updater_->compute(scan); }).cpu_s;
    ohm::Voxel<float> voxel(&map(), layer());
    for (const BrickUpdate& brick : update->bricks) {
      forEachCell(brick.brick, brick.misses.without(brick.hits),
                  [&voxel](const Cell& cell) { ohm::integrateMiss(voxel.setKey(toKey(cell))); });
      forEachCell(brick.brick, brick.hits,
                  [&voxel](const Cell& cell) { ohm::integrateHit(voxel.setKey(toKey(cell))); });
    }
  }

  void dropScratch() override { updater_.reset(); }

  [[nodiscard]] MapFigures figures() const override {
    MapFigures figures = OhmAdapter::figures();
    figures.ray_walk_cpu_s = ray_walk_cpu_s_;
    return figures;
  }

 private:
  std::unique_ptr<ScanUpdater> updater_;
  double ray_walk_cpu_s_ = 0.0;
};

}  // namespace

std::unique_ptr<PeerAdapter> makeOhmAdapter(const InsertionConfig& config) {
  return std::make_unique<OhmVoxelAdapter>(config);
}

}  // namespace cuboid_mapping::bench
