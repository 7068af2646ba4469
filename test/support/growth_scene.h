// SPDX-License-Identifier: BSD-3-Clause
// Cells put into an R-tree by hand, and grown there.
#pragma once

#include "cuboid_mapping/fusion/growth_fusion.h"
#include "cuboid_mapping/map/tree_writer.h"
#include "support/cuboid_set.h"
#include "support/voxel_map.h"

#include <map>
#include <vector>

namespace cuboid_mapping::test {

/// A grid whose cells are given, with the R-tree that they are in.
class GrowthScene {
 public:
  explicit GrowthScene(const GrowthConfig& config = {}, const RTreeConfig& rtree = {4, 2})
      : tree_(rtree), growth_(config, model_) {}

  [[nodiscard]] const SensorModel& model() const { return model_; }
  [[nodiscard]] float stableFree() const { return model_.min(); }
  [[nodiscard]] float stableOccupied() const { return model_.max(); }
  /// Free, but not below alpha_min.
  [[nodiscard]] float unstable() const { return model_.min() + 0.5F; }

  void set(const CellBox& box, float log_odds) {
    visitCells(box, [&](const Cell& cell) {
      DenseBrick& brick = bricks_[brickOf(cell)];
      brick.brick = brickOf(cell);
      brick.known[static_cast<std::size_t>(cell.z & 7)] |= voxelBit(cell);
      brick.log_odds[static_cast<std::size_t>(voxelIndex(cell))] = log_odds;
    });
  }

  /// Writes what was set to the tree, as one cloud.
  void write() {
    ++cloud_;
    for (const auto& [cell, brick] : bricks_) {
      for (const BrickChange& change :
           writer_.update({&brick}, tree_, changes_, content_, classes_)) {
        growth_.note(brick, change, cloud_);
      }
    }
  }

  /// Lets the cells grow in which these voxels lie. @return All cuboids, sorted.
  std::vector<Cuboid> fuse(const std::vector<Cell>& starters) {
    write();
    (void)growth_.fuse(starters, cloud_, tree_);
    return allCuboids(tree_);
  }

  [[nodiscard]] const RTree& tree() const { return tree_; }

 private:
  SensorModel model_;
  RTree tree_;
  GrowthFusion growth_;
  TreeWriter writer_;
  ChangeSet changes_;
  MapContent content_;
  VoxelClasses classes_;
  std::map<Cell, DenseBrick> bricks_;
  std::uint64_t cloud_ = 0;
};

}  // namespace cuboid_mapping::test
