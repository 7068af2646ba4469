// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/fusion/fusion_strategy.h"
#include "cuboid_mapping/geometry/grid.h"
#include "cuboid_mapping/map/change_set.h"
#include "cuboid_mapping/occupancy/sensor_model.h"
#include "cuboid_mapping/rtree/rtree.h"
#include "cuboid_mapping/scan/scan_update.h"

#include <array>
#include <memory>
#include <string>
#include <vector>

namespace cuboid_mapping {

/// Parameters of a map; each has its range in the documentation of its own type.
struct MapConfig {
  double resolution_m = 0.05;  ///< Edge of a voxel, > 0.
  SensorModelConfig sensor_model;
  Environment environment = Environment::kDynamic;
  std::string fusion = fusionNames().front();
  RTreeConfig rtree;
};

/// How much a map holds.
struct MapContent {
  std::size_t free_cuboids = 0;
  std::size_t occupied_cuboids = 0;
  double free_voxels = 0.0;
  double occupied_voxels = 0.0;
};

/// The map: disjoint cuboids in an R-tree, which is its only store (paper, Section IV). A voxel in
/// no cuboid is unknown. This class is the one door through which a map changes.
///
/// Const functions may run side by side; a change needs exclusive access.
class CuboidMap {
 public:
  /// @pre the values of `config` are in their ranges, `config.fusion` is one of fusionNames().
  explicit CuboidMap(const MapConfig& config = {});

  /// Updates the observed voxels (paper, Section IV-A) and fuses the bricks that have changed
  /// (Section IV-B). Cuboids that the cloud contradicts are split on the way.
  /// @complexity O(b (log n + c)) for b touched bricks of c cuboids.
  ChangeSet apply(const ScanUpdate& update);

  /// Forgets everything.
  ChangeSet clear();

  [[nodiscard]] const MapConfig& config() const { return config_; }
  [[nodiscard]] const Grid& grid() const { return grid_; }
  [[nodiscard]] const SensorModel& sensorModel() const { return sensor_model_; }
  [[nodiscard]] const RTree& tree() const { return tree_; }
  /// Rises with every change of content.
  [[nodiscard]] std::uint64_t revision() const { return revision_; }
  [[nodiscard]] const MapContent& content() const { return content_; }

 private:
  using BrickIterator = std::vector<BrickUpdate>::const_iterator;
  static constexpr std::size_t kGroupBricks = 64;

  void applyGroup(BrickIterator first, BrickIterator last, ChangeSet& changes);
  void sortIntoBricks(const CellBox& window);
  [[nodiscard]] bool changesBrick(const BrickUpdate& update,
                                  const std::vector<std::uint32_t>& members) const;
  void rebuildBrick(const BrickUpdate& update, const std::vector<std::uint32_t>& members);
  void cutOutside(const std::vector<CellBox>& changed);
  void replaceInTree();

  MapConfig config_;
  Grid grid_;
  SensorModel sensor_model_;
  std::unique_ptr<FusionStrategy> fusion_;
  RTree tree_;
  std::uint64_t revision_ = 0;
  MapContent content_;

  // Scratch of applyGroup, kept to reuse its memory.
  Selection selection_;
  std::array<std::vector<std::uint32_t>, kGroupBricks> members_;  ///< Of selection_, by brick.
  std::vector<std::uint32_t> crossing_;  ///< Of selection_: cuboids that reach beyond one brick.
  std::vector<char> is_removed_;         ///< Of selection_.
  std::vector<Cuboid> partition_;
  std::vector<Cuboid> added_;
  DenseBrick dense_;
};

}  // namespace cuboid_mapping
