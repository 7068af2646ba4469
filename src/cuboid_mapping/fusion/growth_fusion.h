// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/fusion/growing_bricks.h"
#include "cuboid_mapping/fusion/grown_bricks.h"
#include "cuboid_mapping/fusion/growth_config.h"
#include "cuboid_mapping/occupancy/sensor_model.h"
#include "cuboid_mapping/scan/brick_update.h"
#include "cuboid_mapping/voxels/voxel_store.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace cuboid_mapping {

/// A change of the fused cuboids that is computed, and not made yet. Once made, it holds what it has replaced.
struct GrowthChange {
  std::vector<GrownBrick> bricks;      ///< New state of the bricks that change.
  std::vector<Cell> with_new_cuboids;  ///< The bricks whose fused cuboids change.
  /// The bricks in which voxels begin to wait with this change.
  std::vector<Cell> with_held_voxels;
  bool is_cloud = false;  ///< Whether it counts as a cloud; else it is an edit.
};

/// Fusion of the paper, Section IV-B, in the bricks: see Grower.
///
/// Cells that are not stable stay single: a voxel of a fused cuboid that stops being stable, or gets another class,
/// is split out, and waits some clouds before it may fuse again. After an edit, stable voxels that were unknown are
/// large boxes, brick by brick. The result depends on the order of clouds.
///
/// Const functions may run side by side, not beside a change.
class GrowthFusion {
 public:
  /// @param model  Sensor model of the map: its clamping thresholds say which voxels are stable.
  GrowthFusion(const GrowthConfig& config, const SensorModel& model);

  /// Computes the cuboids after a cloud. @param voxels  The voxels before it. @param change  Its change of them.
  /// @param observed  The bricks of the cloud along the Morton curve. @param samples  Cells along its beams.
  /// @throws std::bad_alloc
  [[nodiscard]] GrowthChange prepareCloud(const VoxelStore& voxels,
                                          const VoxelStore::PendingChange& change,
                                          const std::vector<BrickUpdate>& observed,
                                          const std::vector<Cell>& samples) const;
  /// Computes the cuboids after an edit. @throws std::bad_alloc
  [[nodiscard]] GrowthChange prepareEdit(const VoxelStore& voxels,
                                         const VoxelStore::PendingChange& change) const;
  /// Computes the cuboids with other clamping thresholds. @throws std::bad_alloc
  [[nodiscard]] GrowthChange prepareModel(const VoxelStore& voxels, const SensorModel& model) const;
  /// Computes the change to these fused cuboids. Those that do not fit the voxels, or overlap earlier ones, are left out.
  /// @throws std::bad_alloc
  [[nodiscard]] GrowthChange prepareCuboids(const VoxelStore& voxels,
                                            const std::vector<Cuboid>& cuboids) const;
  /// Reserves memory for a change. @throws std::bad_alloc  Nothing has changed then.
  void reserve(const GrowthChange& change);
  /// Makes a change. @pre Nothing has changed since it was computed, and reserve() was called.
  void commit(GrowthChange& change) noexcept;
  /// Sets clamping thresholds whose change was made.
  void setSensorModel(const SensorModel& model) noexcept { model_ = model; }

  /// The fused cuboids.
  [[nodiscard]] const GrownBricks& bricks() const { return bricks_; }
  /// Bytes held from the allocator. @complexity O(bricks).
  [[nodiscard]] std::size_t numBytes() const;

 private:
  [[nodiscard]] FusionThresholds thresholdsOf(const SensorModel& model) const;
  [[nodiscard]] std::vector<Cell> release(GrowingBricks& bricks, std::uint64_t cloud) const;

  GrowthConfig config_;
  std::shared_ptr<const GrowthRules> rules_;
  SensorModel model_;
  GrownBricks bricks_;
  std::uint64_t num_clouds_ = 0;
  /// Bricks with voxels that began to wait, for each of the last `settle_clouds` clouds.
  std::vector<std::vector<Cell>> waiting_;
};

}  // namespace cuboid_mapping
