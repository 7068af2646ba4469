// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/fusion/fusion.h"
#include "cuboid_mapping/fusion/fusion_kind.h"
#include "cuboid_mapping/fusion/growth_config.h"
#include "cuboid_mapping/geometry/grid.h"
#include "cuboid_mapping/map/config_check.h"
#include "cuboid_mapping/map/locked_boxes.h"
#include "cuboid_mapping/occupancy/cuboid.h"
#include "cuboid_mapping/occupancy/sensor_model.h"
#include "cuboid_mapping/voxels/change_set.h"
#include "cuboid_mapping/voxels/voxel_store.h"

#include <limits>
#include <memory>
#include <vector>

/// A 3D occupancy map of cuboids: the library, which does not need ROS. Cells count voxels, figures
/// with _m are metres in the map frame.
namespace cuboid_mapping {

/// Parameters of a map; checkConfig() says which are outside their ranges, which are documented here
/// and at their types.
struct MapConfig {
  /// Bounds that checkConfig() sets for `resolution_m` and `threads`.
  ///@{
  static constexpr double kMinResolution_m = 1e-3;
  static constexpr double kMaxResolution_m = 1e2;
  static constexpr int kMaxThreads = 256;
  ///@}

  double resolution_m = 0.05;      ///< Edge of a voxel: kMinResolution_m to kMaxResolution_m.
  SensorModelConfig sensor_model;  ///< Probabilities of hit and miss, and clamping thresholds.
  Environment environment = Environment::kDynamic;  ///< Whether stable voxels are updated.
  FusionKind fusion = FusionKind::kClass;           ///< How voxels become cuboids.
  GrowthConfig growth;                              ///< Of FusionKind::kGrowth.
  RTreeConfig rtree;                                ///< Order (d, M) of the R-tree.
  int threads = 1;  ///< For changes of the map, 1 to kMaxThreads. The result does not depend on it.

  /// How the beams of a scan have to be sampled for this map.
  [[nodiscard]] BeamSampling beamSampling() const {
    const bool needs_samples =
        fusion == FusionKind::kGrowth && growth.starters == GrowthStarters::kSampled;
    return needs_samples ? growth.sampling : BeamSampling{};
  }
};

/// All cells that a map can have.
constexpr CellBox kAllCells{{-Grid::kMaxCell, -Grid::kMaxCell, -Grid::kMaxCell},
                            {Grid::kMaxCell, Grid::kMaxCell, Grid::kMaxCell}};

/// The map: the exact log-odds of all known voxels, and disjoint cuboids of one class in an R-tree
/// (paper, Section IV). This class is the one door through which a map changes.
///
/// Voxels and their classes are always current. Cuboids are put into the R-tree by fuse(), at the
/// latest when no cloud has changed a class in their brick for some time; those who read cuboids
/// (cuboid_search.h) get the current ones in any case, because a brick that waits is divided
/// for them. With FusionKind::kClass and kNone the cuboids are a function of the classes of the
/// voxels alone.
///
/// A change that throws std::bad_alloc has not been made: voxels, cuboids, locks and revision are as
/// they were. Where memory runs out later, while cuboids are put into the R-tree, voxels and answers
/// stay right: cuboids are made anew from the voxels when there is memory again.
///
/// Const functions may run side by side; a change needs exclusive access.
class CuboidMap {
 public:
  /// @throws std::invalid_argument  with everything that checkConfig() finds.
  explicit CuboidMap(const MapConfig& config = {});

  /// Updates the observed voxels (paper, Section IV-A).
  /// @complexity O(b v + c log n) for b touched bricks of v different log-odds, and c cuboids of
  /// bricks that have gone cold.
  ChangeSet apply(const ScanUpdate& update) { return apply(update, sensor_model_); }
  /// As above, with the hit and miss of another sensor.
  /// @pre Thresholds and environment of `model` are those of sensorModel().
  ChangeSet apply(const ScanUpdate& update, const SensorModel& model);

  /// The two halves of apply(), for those who let others read as long as possible.
  /// @pre Nothing changes the map between them.
  ///@{
  /// Works out what becomes of the voxels, most of the time of apply(). Changes nothing: const
  /// functions may run beside it. @throws std::bad_alloc
  [[nodiscard]] VoxelStore::PendingChange prepare(const ScanUpdate& update,
                                                  const SensorModel& model);
  /// @param update  The same.
  ChangeSet commit(const ScanUpdate& update, VoxelStore::PendingChange& change);
  ///@}

  /// Brings cuboids that wait into the R-tree (paper, Section IV-B).
  /// @param max_bricks  After so many it is left to another call to go on.
  /// @return Whether all are there. @complexity O(c log n) for c cuboids of these bricks.
  bool fuse(std::size_t max_bricks = std::numeric_limits<std::size_t>::max());

  /// Puts voxels in the place of everything inside a box, exactly. For edits, loading, and copies
  /// that follow another map. Locked voxels are replaced, too.
  ///
  /// Cases:
  ///   - no voxels: the box becomes unknown; an empty box: nothing happens;
  ///   - the voxels are there already: no change, the revision stays.
  ///
  /// @param bricks  Each once, with log-odds of any finite value; what lies outside the box is not
  ///                looked at.
  /// @complexity O(bricks that the box shares a cell with, or all known bricks if these are fewer;
  /// and `bricks`).
  ChangeSet replace(const CellBox& box, const std::vector<VoxelBrick>& bricks);
  /// As above. @param boxes  Disjoint, inside the box, with finite log-odds.
  ChangeSet replace(const CellBox& box, const std::vector<UniformBox>& boxes);

  /// Exchanges all voxels and cuboids with another map, which may have been built while this one was
  /// in use. Locks stay. @pre The configs are equal. @complexity O(1).
  ChangeSet exchange(CuboidMap& other);

  /// Keeps clouds from changing the voxels of a box, known or not; replace() and clear() still do.
  void lock(const CellBox& box) { locked_.add(box); }
  /// Undoes lock() for the voxels of a box, whatever boxes they were locked with.
  void unlock(const CellBox& box) { locked_.remove(box); }
  /// Locks these voxels, and no others.
  void setLocked(LockedBoxes locked) { locked_ = std::move(locked); }
  /// What is locked; changed through lock(), unlock() and setLocked() only.
  [[nodiscard]] const LockedBoxes& locked() const { return locked_; }

  /// Takes another sensor model for the clouds to come. Log-odds stay as they are, also beyond new
  /// clamping thresholds, until a cloud touches them. With FusionKind::kGrowth, voxels that are not
  /// stable any more become single cells. @throws std::invalid_argument as the constructor; the map is
  /// then as it was.
  ChangeSet setSensorModel(const SensorModelConfig& sensor_model);

  /// Forgets everything, locks too.
  ChangeSet clear();

  /// As given to the constructor, with the sensor model that counts now.
  [[nodiscard]] const MapConfig& config() const { return config_; }
  /// For conversions between metres and cells.
  [[nodiscard]] const Grid& grid() const { return grid_; }
  /// What the next cloud is put in with.
  [[nodiscard]] const SensorModel& sensorModel() const { return sensor_model_; }
  /// Rises with every change of the value of a voxel.
  [[nodiscard]] std::uint64_t revision() const { return revision_; }
  /// The known voxels, always current.
  [[nodiscard]] const VoxelStore& voxels() const { return voxels_; }
  /// The cuboids, current or waiting; to be read through cuboid_search.h.
  [[nodiscard]] const Fusion& fusion() const { return *fusion_; }
  /// The R-tree with all cuboids, after fuse().
  [[nodiscard]] const RTree& tree() {
    fuse();
    return fusion_->tree();
  }
  /// Bytes held from the allocator.
  [[nodiscard]] std::size_t numBytes() const { return voxels_.numBytes() + fusion_->numBytes(); }

 private:
  ChangeSet finish(bool is_changed, ChangeSet changes);

  MapConfig config_;
  Grid grid_;
  SensorModel sensor_model_;
  VoxelStore voxels_;
  std::unique_ptr<Fusion> fusion_;
  LockedBoxes locked_;
  std::uint64_t revision_ = 0;
};

}  // namespace cuboid_mapping
