// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/fusion/cuboid_tree.h"
#include "cuboid_mapping/fusion/growth_config.h"
#include "cuboid_mapping/fusion/settling_cells.h"
#include "cuboid_mapping/occupancy/sensor_model.h"
#include "cuboid_mapping/rtree/rtree.h"
#include "cuboid_mapping/voxels/brick_table.h"
#include "cuboid_mapping/voxels/change_set.h"

#include <cstdint>
#include <optional>
#include <unordered_set>
#include <utility>
#include <vector>

namespace cuboid_mapping {

/// Changes of the tree from new voxels, before any cell grows.
struct CellWrites {
  /// A brick with changed voxels.
  struct BrickWrite {
    Cell brick;
    BrickMask changed;  ///< Voxels with another value.
    BrickMask split;    ///< Changed voxels that were in a cuboid of several voxels.
    BrickMask fusible;  ///< Stable voxels that do not settle, afterwards.
    bool is_reclassified;
  };
  std::vector<BrickWrite> bricks;                    ///< Bricks in the order of the change.
  std::vector<std::pair<CellBox, Cuboid>> replaced;  ///< Cuboids and their replacements.
  std::vector<CellBox> removed;                      ///< Removed cuboids.
  std::vector<Cuboid> added;                         ///< Added cuboids.
  std::vector<CellBox> split;  ///< Cuboids of several voxels that lose voxels.
};

/// Adaptation of the cell resolution by growth (paper, Section IV-B and Figure 5): a stable cell expands in one
/// search direction after the other. An expansion succeeds if cells inside the added slab fill it (6), and are
/// stable in the same class (7), (8). These cells are removed from the R-tree, and the fused cuboid is
/// inserted.
///
/// Cells that are not stable stay single: a voxel of a fused cuboid that stops being stable, or gets
/// another class, is split out. After an edit, stable voxels that were unknown are put into the tree
/// as large boxes, brick by brick. The result does not depend on the order (d, M) of the R-tree.
class GrowthFusion : public CuboidTree {
 public:
  /// @param model  Sensor model of the map: its clamping thresholds say which voxels are stable.
  GrowthFusion(const GrowthConfig& config, const RTreeConfig& rtree, const SensorModel& model)
      : config_(config), model_(model), tree_(rtree), settling_(config.settle_clouds) {}

  /// Computes the changes of the tree from new voxels, and reserves memory for them.
  /// @param is_edit  Stable voxels that were unknown may be cuboids of several voxels.
  /// @throws std::bad_alloc  Nothing has changed then.
  [[nodiscard]] CellWrites prepare(const VoxelStore::PendingChange& change, bool is_edit);
  /// As above, for new clamping thresholds.
  [[nodiscard]] CellWrites prepare(const VoxelStore& voxels, const SensorModel& model);
  /// Writes changes to the tree. @pre Nothing has changed since prepare().
  void commit(const CellWrites& writes) noexcept;
  /// Sets clamping thresholds whose changes were committed.
  void setSensorModel(const SensorModel& model) noexcept { model_ = model; }
  /// Grows cells after the changes of a cloud. If memory runs out, they stop.
  /// @param changes  Gets the bricks of the cells that have grown.
  void grow(const VoxelStore& voxels, const ScanUpdate& update, const CellWrites& writes,
            ChangeSet& changes) noexcept;

  /// The R-tree of the cuboids.
  [[nodiscard]] const RTree& tree() const { return tree_; }
  void visitBox(const VoxelStore& voxels, const CellBox& window, CuboidFilter filter,
                CuboidVisitor visit) const override;
  void visitNearest(const VoxelStore& voxels, const Eigen::Vector3d& point, double max_distance,
                    CuboidFilter filter, DistanceVisitor visit) const override;
  [[nodiscard]] const InnerTree& inner() const override { return tree_.inner(); }
  [[nodiscard]] std::size_t numLeafNodes(const VoxelStore& /*voxels*/) const override {
    return tree_.numLeafNodes();
  }
  /// Bytes without the settling cells.
  [[nodiscard]] std::size_t numBytes() const override {
    return tree_.numBytes() + fusible_.numBytes();
  }

 private:
  struct Growth;
  struct FusibleBrick {
    Cell brick;
    BrickMask fusible;
  };

  void reserve(const CellWrites& writes);
  void settleAndGrow(const VoxelStore& voxels, const ScanUpdate& update, const CellWrites& writes,
                     ChangeSet& changes);
  [[nodiscard]] bool isAllFusible(const VoxelStore& voxels, const CellBox& box,
                                  Occupancy occupancy) const;
  [[nodiscard]] bool isFusible(const Cell& cell) const;
  void grow(const VoxelStore& voxels, const std::vector<Cell>& observed,
            std::vector<CellBox>& fused);
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
  RTree tree_;
  std::uint64_t num_clouds_ = 0;
  BrickTable<FusibleBrick> fusible_;  ///< Stable voxels that do not settle.
  SettlingCells settling_;
  Cells starters_;  ///< Least cells of the cuboids in T.
  Cells tried_;     ///< Cells that could not grow in this pass.
};

}  // namespace cuboid_mapping
