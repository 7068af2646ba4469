// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/fusion/fusion_strategy.h"
#include "cuboid_mapping/fusion/growth_fusion.h"
#include "cuboid_mapping/geometry/grid.h"
#include "cuboid_mapping/map/brick_cache.h"
#include "cuboid_mapping/map/change_set.h"
#include "cuboid_mapping/map/locked_boxes.h"
#include "cuboid_mapping/map/map_content.h"
#include "cuboid_mapping/map/tree_writer.h"
#include "cuboid_mapping/map/voxel_classes.h"
#include "cuboid_mapping/occupancy/sensor_model.h"
#include "cuboid_mapping/rtree/rtree.h"
#include "cuboid_mapping/scan/scan_update.h"

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping {

/// Parameters of a map; each has its range in the documentation of its own type.
struct MapConfig {
  double resolution_m = 0.05;  ///< Edge of a voxel, > 0.
  SensorModelConfig sensor_model;
  Environment environment = Environment::kDynamic;
  std::string fusion = fusionNames().front();
  GrowthConfig growth;  ///< Of the fusion "growth".
  RTreeConfig rtree;
  std::size_t hot_bytes = 0;  ///< Bound of the memory for hot bricks; 0: write-through.
  int threads = 1;            ///< For changes of the map, >= 1. The result does not depend on it.

  /// How ScanUpdater has to sample the beams for this map.
  [[nodiscard]] BeamSampling beamSampling() const {
    const bool needs_samples =
        fusion == kGrowthFusion && growth.starters == GrowthStarters::kSampled;
    return needs_samples ? growth.sampling : BeamSampling{};
  }
};

/// All cells that a map can have.
constexpr CellBox kAllCells{{-Grid::kMaxCell, -Grid::kMaxCell, -Grid::kMaxCell},
                            {Grid::kMaxCell, Grid::kMaxCell, Grid::kMaxCell}};

/// The map: disjoint cuboids in an R-tree, which is its only store (paper, Section IV); a voxel in
/// no cuboid is unknown. This class is the one door through which a map changes.
///
/// With `hot_bytes`, the bricks that clouds touch again and again stay decoded for a while: clouds
/// are applied to them, and they are written back to the R-tree as fused cuboids when no cloud has
/// touched them for some time, when there is no room for more, or with flush(). The map is, voxel
/// by voxel, the same; and after flush() the cuboids are the same, too, with a fusion strategy that
/// looks at single bricks. Everything that reads the map sees the R-tree only: flush what is to be
/// looked at first.
///
/// Const functions may run side by side; a change needs exclusive access.
class CuboidMap {
 public:
  /// @pre the values of `config` are in their ranges, `config.fusion` is one of fusionNames().
  explicit CuboidMap(const MapConfig& config = {});

  /// Updates the observed voxels (paper, Section IV-A) and fuses the bricks that have changed
  /// (Section IV-B), with hot bricks those that are written back. Cuboids that the cloud contradicts
  /// are split on the way.
  /// @complexity O(b (log n + c)) for b touched bricks of c cuboids.
  ChangeSet apply(const ScanUpdate& update);

  /// Writes hot bricks back to the R-tree: all, or those that share a cell with a region. They stay
  /// hot. @complexity O(b (log n + c)) for b bricks of c cuboids that have changed.
  /// @param max_groups  Of 4 x 4 x 4 bricks: after so many it is left to another call to go on.
  ChangeSet flush();
  ChangeSet flush(const CellBox& region,
                  std::size_t max_groups = std::numeric_limits<std::size_t>::max());
  /// Whether nothing in the region waits to be written back.
  [[nodiscard]] bool isFlushed(const CellBox& region) const;
  /// As flush(), and gives the memory of the hot bricks back: for when no clouds come for a while.
  ChangeSet cool();

  /// Puts cuboids in the place of everything inside a box, exactly: cuboids that reach beyond the
  /// box are cut at its faces. For edits, loading, and copies that follow another map.
  ///
  /// Cases:
  ///   - no cuboids: the box becomes unknown; an empty box: nothing happens;
  ///   - the cuboids are there already: no change, the revision stays.
  /// Nothing is fused: the cuboids are kept as they are, until a cloud touches their bricks. Locked
  /// voxels are replaced, too.
  ///
  /// @param cuboids  Disjoint, inside the box, with log-odds as the sensor model has them.
  /// @complexity O((k + c) log n) for k cuboids that are replaced by c, and the flush of the box.
  ChangeSet replace(const CellBox& box, const std::vector<Cuboid>& cuboids);

  /// Keeps clouds from changing the voxels of a box, known or not; replace() and clear() still do.
  void lock(const CellBox& box) { locked_.add(box); }
  /// Undoes lock() for the voxels of a box, whatever boxes they were locked with.
  void unlock(const CellBox& box) { locked_.remove(box); }
  [[nodiscard]] const LockedBoxes& locked() const { return locked_; }

  /// Takes another sensor model for the clouds to come. Log-odds beyond new clamping thresholds stay
  /// until a cloud touches them. @pre its values are in their ranges.
  void setSensorModel(const SensorModelConfig& sensor_model);

  /// Forgets everything, locks too.
  ChangeSet clear();

  [[nodiscard]] const MapConfig& config() const { return config_; }
  [[nodiscard]] const Grid& grid() const { return grid_; }
  [[nodiscard]] const SensorModel& sensorModel() const { return sensor_model_; }
  [[nodiscard]] const RTree& tree() const { return tree_; }
  /// Rises with every change of the value of a voxel.
  [[nodiscard]] std::uint64_t revision() const { return revision_; }
  /// What is in the R-tree.
  [[nodiscard]] const MapContent& content() const { return content_; }
  /// Classes of the voxels in the R-tree.
  [[nodiscard]] const VoxelClasses& classes() const { return classes_; }
  /// Bytes held from the allocator: R-tree, classes and hot bricks.
  [[nodiscard]] std::size_t numBytes() const {
    return tree_.numBytes() + classes_.numBytes() + hot_.numBytes() +
           (growth_ ? growth_->numBytes() : 0);
  }
  [[nodiscard]] std::size_t numHotBytes() const { return hot_.numBytes(); }

 private:
  using BrickIterator = std::vector<BrickUpdate>::const_iterator;
  struct GroupUpdate;
  struct DirtyBricks {
    HotGroup* group;
    std::uint64_t bricks;  ///< Bit per brick.
  };

  [[nodiscard]] BrickIterator findChunkEnd(BrickIterator first, BrickIterator last) const;
  [[nodiscard]] bool applyChunk(BrickIterator first, BrickIterator last, ChangeSet& changes);
  void load(const GroupUpdate& update) const;
  [[nodiscard]] static std::uint64_t dirtyBricks(const HotGroup& group, const CellBox& region);
  void evict(std::size_t num_kept, ChangeSet& changes);
  void evictCold(ChangeSet& changes);
  void evictLast(std::size_t num_groups, ChangeSet& changes);
  void flush(const CellBox& region, std::size_t max_groups, ChangeSet& changes);
  void writeBack(const std::vector<DirtyBricks>& dirty, ChangeSet& changes);
  void writePartitions(const std::vector<const DenseBrick*>& bricks, ChangeSet& changes);
  void writeCells(const std::vector<const DenseBrick*>& bricks, ChangeSet& changes);
  void grow(const ScanUpdate& update, ChangeSet& changes);

  MapConfig config_;
  Grid grid_;
  SensorModel sensor_model_;
  std::unique_ptr<FusionStrategy> fusion_;  ///< Null with growth_.
  std::optional<GrowthFusion> growth_;
  RTree tree_;
  VoxelClasses classes_;
  BrickCache hot_;
  LockedBoxes locked_;
  TreeWriter writer_;
  std::uint64_t num_clouds_ = 0;
  std::uint64_t revision_ = 0;
  MapContent content_;
};

}  // namespace cuboid_mapping
