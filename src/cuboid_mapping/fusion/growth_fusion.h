// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/fusion/fusion.h"
#include "cuboid_mapping/fusion/growth_config.h"
#include "cuboid_mapping/fusion/settling_cells.h"
#include "cuboid_mapping/occupancy/sensor_model.h"

#include <cstdint>
#include <optional>
#include <unordered_set>
#include <vector>

namespace cuboid_mapping {

/// Adaptation of the cell resolution by growth (paper, Section IV-B and Figure 5): a stable cell
/// expands in one search direction after the other; an expansion succeeds when the slab that it
/// adds is wholly tiled by cells that lie inside it (6) and are stable in the same class (7), (8).
/// They are removed from the R-tree, and the fused cuboid is inserted.
///
/// Cells that are not stable stay single: a voxel of a fused cuboid that stops being stable, or gets
/// another class, is split out. After an edit, stable voxels that were unknown are put into the tree
/// as large boxes, brick by brick; so are all after memory ran out. Else nothing waits. The result
/// does not depend on the order (d, M) of the R-tree.
class GrowthFusion : public Fusion {
 public:
  /// @param model  That of the map: its clamping thresholds say which voxels are stable.
  GrowthFusion(const GrowthConfig& config, const RTreeConfig& rtree, const SensorModel& model)
      : Fusion(rtree), config_(config), model_(model), settling_(config.settle_clouds) {}

  void announce(const std::vector<BrickChange>& /*changed*/, ChangeSet& /*changes*/) override {}
  void noteCloud(const VoxelStore& voxels, const ScanUpdate& update,
                 const std::vector<BrickChange>& changed, ChangeSet& changes) noexcept override;
  void noteEdit(const VoxelStore& voxels, const std::vector<BrickChange>& changed,
                ChangeSet& changes) noexcept override;
  void setSensorModel(const VoxelStore& voxels, const SensorModel& model,
                      ChangeSet& changes) noexcept override;
  void fuse(const VoxelStore& voxels, std::size_t max_bricks) override;
  void divide(const VoxelBrick& brick, std::vector<Cuboid>& cuboids) const override;
  void clear() noexcept override;
  /// Without those of cells that settle.
  [[nodiscard]] std::size_t numBytes() const override {
    return Fusion::numBytes() + fusible_.numBytes();
  }

 private:
  struct Growth;
  struct FusibleBrick {
    Cell brick;
    BrickMask fusible;
  };
  /// Voxels of a brick that have changed, and those of them that were in a cuboid of several.
  struct CellChange {
    Cell brick;
    BrickMask changed;
    BrickMask split;
  };

  template <typename WorkT>
  void follow(const VoxelStore& voxels, ChangeSet& changes, WorkT work) noexcept;
  void writeAll(const VoxelStore& voxels);
  void writeEdit(const VoxelStore& voxels, const std::vector<BrickChange>& changed,
                 ChangeSet& changes);
  std::vector<CellChange> writeCells(const VoxelStore& voxels,
                                     const std::vector<BrickChange>& changed, bool is_edit,
                                     ChangeSet& changes);
  void updateFusible(const VoxelStore& voxels, const Cell& brick);
  void writeAndGrow(const VoxelStore& voxels, const ScanUpdate& update,
                    const std::vector<BrickChange>& changed, ChangeSet& changes);
  [[nodiscard]] bool isAllFusible(const VoxelStore& voxels, const CellBox& box,
                                  Occupancy occupancy) const;
  [[nodiscard]] bool isFusible(const Cell& cell) const;
  std::vector<CellBox> grow(const VoxelStore& voxels, const std::vector<Cell>& observed);
  [[nodiscard]] std::vector<Cell> releaseSettled(const VoxelStore& voxels);
  void tryCell(const VoxelStore& voxels, const Cell& cell, std::vector<CellBox>& fused);
  [[nodiscard]] bool expand(const VoxelStore& voxels, Growth& growth) const;
  [[nodiscard]] bool expandMost(const VoxelStore& voxels, Growth& growth) const;
  [[nodiscard]] std::optional<CellBox> findSlab(const VoxelStore& voxels, SearchDirection direction,
                                                const Growth& growth) const;
  [[nodiscard]] bool absorb(const VoxelStore& voxels, SearchDirection direction,
                            Growth& growth) const;
  [[nodiscard]] SearchDirections directionsOf(const CellBox& box) const;
  [[nodiscard]] std::vector<Cell> findStartersBeside(const std::vector<CellBox>& fused,
                                                     std::size_t first) const;

  using Cells = std::unordered_set<Cell, CellHash>;

  GrowthConfig config_;
  SensorModel model_;
  std::uint64_t num_clouds_ = 0;
  BrickTable<FusibleBrick> fusible_;  ///< Stable voxels that do not settle.
  SettlingCells settling_;
  Cells starters_;  ///< Least cells of cuboids that are in T.
  Cells tried_;     ///< Those of them that could not grow in this pass.
};

}  // namespace cuboid_mapping
