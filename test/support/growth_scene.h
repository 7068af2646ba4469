// SPDX-License-Identifier: BSD-3-Clause
// Hand-painted cells that grow.
#pragma once

#include "cuboid_mapping/fusion/growth_fusion.h"
#include "cuboid_mapping/rtree/traversal.h"
#include "cuboid_mapping/voxels/brick_store.h"
#include "support/cuboid_set.h"

#include <map>
#include <vector>

namespace cuboid_mapping::test {

/// A grid with given cells, and their R-tree.
class GrowthScene {
 public:
  explicit GrowthScene(const GrowthConfig& config = {}, const RTreeConfig& rtree = {4, 2})
      : growth_(config, rtree, model_) {}

  [[nodiscard]] const SensorModel& model() const { return model_; }
  [[nodiscard]] float stableFree() const { return model_.min(); }
  [[nodiscard]] float stableOccupied() const { return model_.max(); }
  /// Free, but not below alpha_min.
  [[nodiscard]] float unstable() const { return model_.min() + 0.5F; }

  void set(const CellBox& box, float log_odds) { paint(box, {BrickMask::all(), log_odds}); }
  void forget(const CellBox& box) { paint(box, {}); }

  /// Writes painted cells to the tree, as one cloud.
  void write() { (void)fuse({}); }

  /// Calls write(), and grows the cells of these voxels. @return All cuboids, sorted.
  std::vector<Cuboid> fuse(const std::vector<Cell>& starters) {
    ScanUpdate update;
    update.samples = starters;
    VoxelStore::PendingChange change = takePainted();
    const CellWrites writes = write(change, false);
    growth_.grow(voxels_, update, writes, changes_);
    return allCuboids(tree());
  }

  /// Writes painted cells to the tree, as an edit.
  std::vector<Cuboid> edit() {
    VoxelStore::PendingChange change = takePainted();
    (void)write(change, true);
    return allCuboids(tree());
  }

  std::vector<Cuboid> setSensorModel(const SensorModelConfig& config) {
    model_ = SensorModel(config);
    const CellWrites writes = growth_.prepare(voxels_, model_);
    note(writes);
    growth_.commit(writes);
    growth_.setSensorModel(model_);
    return allCuboids(tree());
  }

  [[nodiscard]] const GrowthFusion& growth() const { return growth_; }
  [[nodiscard]] const RTree& tree() const { return growth_.tree(); }
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

  CellWrites write(VoxelStore::PendingChange& change, bool is_edit) {
    CellWrites writes = growth_.prepare(change, is_edit);
    voxels_.reserve(change);
    voxels_.commit(change, [](const auto& /*brick*/) {});
    growth_.commit(writes);
    note(writes);
    return writes;
  }

  void note(const CellWrites& writes) {
    changes_ = {};
    for (const auto& brick : writes.bricks) {
      changes_.bricks.push_back({brick.brick, brick.is_reclassified});
    }
    for (const CellBox& box : writes.split) changes_.addCuboidsIn(box);
  }

  SensorModel model_;
  GrowthFusion growth_;
  VoxelStore voxels_;
  ChangeSet changes_;
  std::map<Cell, PackedVoxels> painted_;
};

}  // namespace cuboid_mapping::test
