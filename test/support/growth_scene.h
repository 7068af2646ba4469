// SPDX-License-Identifier: BSD-3-Clause
// Hand-painted cells that grow.
#pragma once

#include "cuboid_mapping/fusion/growth_fusion.h"
#include "cuboid_mapping/voxels/brick_store.h"
#include "cuboid_mapping/voxels/change_set.h"
#include "support/cuboid_set.h"

#include <map>
#include <vector>

namespace cuboid_mapping::test {

/// A grid with given cells, and their fused cuboids.
class GrowthScene {
 public:
  explicit GrowthScene(const GrowthConfig& config = {}) : growth_(config, model_) {}

  [[nodiscard]] const SensorModel& model() const { return model_; }
  [[nodiscard]] float stableFree() const { return model_.min(); }
  [[nodiscard]] float stableOccupied() const { return model_.max(); }
  /// Free, but not below alpha_min.
  [[nodiscard]] float unstable() const { return model_.min() + 0.5F; }

  void set(const CellBox& box, float log_odds) { paint(box, {BrickMask::all(), log_odds}); }
  void forget(const CellBox& box) { paint(box, {}); }

  /// Sets the painted cells, as one cloud.
  void write() { (void)fuse({}); }

  /// Calls write(), and grows the cells of these voxels. @return All cuboids, sorted.
  std::vector<Cuboid> fuse(const std::vector<Cell>& starters) {
    VoxelStore::PendingChange change = takePainted();
    return commit(change, growth_.prepareCloud(voxels_, change, {}, starters));
  }

  /// Sets the painted cells, as an edit.
  std::vector<Cuboid> edit() {
    VoxelStore::PendingChange change = takePainted();
    return commit(change, growth_.prepareEdit(voxels_, change));
  }

  std::vector<Cuboid> setSensorModel(const SensorModelConfig& config) {
    model_ = SensorModel(config);
    VoxelStore::PendingChange change;
    const auto cuboids = commit(change, growth_.prepareModel(voxels_, model_));
    growth_.setSensorModel(model_);
    return cuboids;
  }

  [[nodiscard]] const GrowthFusion& growth() const { return growth_; }
  [[nodiscard]] const VoxelStore& voxels() const { return voxels_; }
  /// Changes of the last cloud or edit.
  [[nodiscard]] const ChangeSet& changes() const { return changes_; }
  [[nodiscard]] bool isStable(const Cell& cell) const {
    const std::optional<float> log_odds = voxels_.logOddsAt(cell);
    return log_odds && model_.isStable(*log_odds);
  }

 private:
  void paint(const CellBox& box, const PackedVoxels& voxels) {
    forEachBrick(box, [&](const Cell& brick) {
      const CellBox part = intersect(box, brickBox(brick));
      PackedVoxels& painted = painted_[brick];
      (void)painted.replace(BrickMask::ofBox(part), voxels, painted);
    });
  }

  VoxelStore::PendingChange takePainted() {
    std::vector<VoxelBrick> bricks;
    for (const auto& [brick, voxels] : painted_) bricks.push_back({brick, voxels});
    return voxels_.prepareReplace({{-1000, -1000, -1000}, {1000, 1000, 1000}}, bricks, {});
  }

  std::vector<Cuboid> commit(VoxelStore::PendingChange& change, GrowthChange grown) {
    voxels_.reserve(change);
    growth_.reserve(grown);
    changes_ = {};
    voxels_.commit(change, [&](const VoxelStore::PendingBrick& brick) {
      changes_.bricks.push_back({brick.brick, brick.is_reclassified});
    });
    growth_.commit(grown);
    for (const Cell& brick : grown.with_new_cuboids) changes_.bricks.push_back({brick, true});
    return cuboids();
  }

  /// Fused cuboids by their first brick, and all other voxels; sorted.
  [[nodiscard]] std::vector<Cuboid> cuboids() const {
    std::vector<Cuboid> all;
    voxels_.forEach([&](const VoxelBrick& brick) {
      BrickMask single = brick.voxels.known();
      if (const GrownBrick* grown = growth_.bricks().find(brick.brick)) {
        single = single.without(grown->fused);
        for (const Cuboid& cuboid : grown->cuboids) {
          if (brickOf(cuboid.box.min) == brick.brick) all.push_back(cuboid);
        }
      }
      forEachCell(brick.brick, single, [&](const Cell& cell) {
        all.push_back({CellBox::ofCell(cell), voxels_.at(cell)});
      });
    });
    return sorted(std::move(all));
  }

  SensorModel model_;
  GrowthFusion growth_;
  VoxelStore voxels_;
  ChangeSet changes_;
  std::map<Cell, PackedVoxels> painted_;
};

}  // namespace cuboid_mapping::test
