// SPDX-License-Identifier: BSD-3-Clause
#include "peers/ohm_map.h"
#include "peers/our_voxels.h"

namespace cuboid_mapping::bench {
namespace {

/// Filled voxel by voxel with our update of each cloud.
class OhmVoxelAdapter : public OhmAdapter {
 public:
  explicit OhmVoxelAdapter(const InsertionConfig& config)
      : OhmAdapter(config.map), voxels_(Grid(config.map.resolution_m), config.max_range_m) {}

  [[nodiscard]] std::string name() const override { return "ohm"; }

  void insert(const Scan& scan) override {
    const ScanUpdate& update = voxels_.compute(scan);
    ohm::Voxel<float> voxel(&map(), layer());
    OurVoxels::forEach(
        update, [&voxel](const Cell& cell) { ohm::integrateMiss(voxel.setKey(toKey(cell))); },
        [&voxel](const Cell& cell) { ohm::integrateHit(voxel.setKey(toKey(cell))); });
  }

  void dropScratch() override { voxels_.drop(); }

  [[nodiscard]] MapFigures figures() const override {
    MapFigures figures = OhmAdapter::figures();
    figures.ray_walk_cpu_s = voxels_.rayWalkCpu_s();
    return figures;
  }

 private:
  OurVoxels voxels_;
};

}  // namespace

std::unique_ptr<PeerAdapter> makeOhmAdapter(const InsertionConfig& config) {
  return std::make_unique<OhmVoxelAdapter>(config);
}

}  // namespace cuboid_mapping::bench
