// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/fusion/fusion_kind.h"
#include "cuboid_mapping/fusion/growth_config.h"
#include "cuboid_mapping/geometry/grid.h"
#include "cuboid_mapping/map/config_check.h"
#include "cuboid_mapping/occupancy/cuboid.h"
#include "cuboid_mapping/occupancy/sensor_model.h"
#include "cuboid_mapping/rtree/rtree_config.h"
#include "cuboid_mapping/voxels/change_set.h"
#include "cuboid_mapping/voxels/voxel_store.h"

#include <memory>
#include <optional>
#include <vector>

/// The library, which does not need ROS: a 3D occupancy map of cuboids. Cells count voxels; names
/// that end in _m are metres in the map frame.
namespace cuboid_mapping {

/// Parameters of a map. Their ranges are documented here and at their types; checkConfig() finds
/// values outside them.
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
  FusionTime fuse = FusionTime::kEveryCloud;        ///< Time at which bricks are divided.
  GrowthConfig growth;                              ///< Settings of FusionKind::kGrowth.
  RTreeConfig rtree;                                ///< Order (d, M) of the R-tree.
  /// Threads for changes of the map, and for the ray walk of a Mapper: 1 to kMaxThreads; results are the same.
  int threads = 1;

  /// Sampling of beams that this map needs.
  [[nodiscard]] BeamSampling beamSampling() const {
    return fusion == FusionKind::kGrowth ? growth.sampling : BeamSampling{};
  }
};

/// All cells that a map can have.
constexpr CellBox kAllCells{{-Grid::kMaxCell, -Grid::kMaxCell, -Grid::kMaxCell},
                            {Grid::kMaxCell, Grid::kMaxCell, Grid::kMaxCell}};

class CuboidTree;
class GrowthFusion;
struct GrowthChange;
class LockedBoxes;

/// The map: the exact log-odds of all known voxels, and disjoint cuboids of one class in an R-tree
/// (paper, Section IV). Every change of a map goes through this class.
///
/// Readers see current voxels and cuboids; cuboid_search.h reads the cuboids. The leaf nodes of the R-tree are the
/// bricks. With FusionKind::kClass and kNone the cuboids are a function of the classes of the voxels alone.
///
/// A change that throws std::bad_alloc has not been made: voxels, cuboids, locks and revision are as before.
///
/// Const functions may run side by side; a change needs exclusive access.
class CuboidMap {
 public:
  /// @throws std::invalid_argument  with everything that checkConfig() finds.
  explicit CuboidMap(const MapConfig& config = {});
  /// Takes over another map, which may only be destroyed or assigned afterwards.
  ///@{
  CuboidMap(CuboidMap&& other) noexcept;
  CuboidMap& operator=(CuboidMap&& other) noexcept;
  ///@}
  ~CuboidMap();

  /// Updates the observed voxels (paper, Section IV-A).
  /// @param update  A brick that comes twice counts as one with the voxels of both.
  /// @complexity O(b v + r log n) for b touched bricks of v different log-odds, r of which are new or have
  /// other classes; with locks or bricks out of order, O(b log b) more. FusionKind::kGrowth also grows cells.
  ChangeSet apply(const ScanUpdate& update) { return apply(update, sensor_model_); }
  /// As above, with the hit and miss of another sensor.
  /// @pre Thresholds and environment of `model` are those of sensorModel().
  ChangeSet apply(const ScanUpdate& update, const SensorModel& model);

  /// A change that is computed, and not made yet. Once made, it holds what it has replaced; its destructor frees the
  /// memory.
  struct PendingChange {
    /// An empty change.
    PendingChange();
    /// A change can be made once.
    ///@{
    PendingChange(PendingChange&& other) noexcept;
    PendingChange& operator=(PendingChange&& other) noexcept;
    ///@}
    ~PendingChange();

    VoxelStore::PendingChange voxels;  ///< Change of the voxels.
    /// Change of the fused cuboids, with FusionKind::kGrowth.
    std::unique_ptr<GrowthChange> growth;
  };

  /// The two halves of apply(), so that other threads can read as long as possible.
  /// @pre Nothing changes the map between them.
  ///@{
  /// Computes the new voxels and cuboids, which is most of the work. Changes nothing: const functions may run beside
  /// it. @throws std::bad_alloc
  [[nodiscard]] PendingChange prepare(const ScanUpdate& update, const SensorModel& model) const;
  /// Makes the change. @throws std::bad_alloc  Nothing has changed then.
  ChangeSet commit(PendingChange& change);
  ///@}

  /// Replaces everything inside a box by voxels, exactly: for edits, loading, and copies of another map. Locked
  /// voxels are replaced, too. A box is cut at kAllCells, here and by lock().
  ///
  /// Cases:
  ///   - no bricks: the box becomes unknown;
  ///   - an empty box, or the voxels are there already: no change, the revision stays.
  ///
  /// Whole bricks are taken over, not encoded again. Replaced bricks are divided into cuboids when they are read.
  ///
  /// @param bricks  Any finite log-odds. If a brick comes twice, the later one counts. Voxels outside the box
  ///                are ignored.
  /// @complexity As VoxelStore::prepareReplace(), and O(log n) for each brick that changes.
  ChangeSet replace(const CellBox& box, std::vector<VoxelBrick> bricks);
  /// As above. @param boxes  Where two overlap, the later one counts. Voxels outside the box are ignored.
  /// @throws std::invalid_argument  Log-odds are not finite; the map is as it was.
  ChangeSet replace(const CellBox& box, const std::vector<UniformBox>& boxes);

  /// Replaces whole bricks in one change, exactly, and keeps all others: for copies of another map. Locked voxels are
  /// replaced, too. @param bricks  As above; one without known voxels becomes unknown. @pre Within kAllCells.
  /// @complexity O(n log n) for n bricks.
  ChangeSet replace(std::vector<VoxelBrick> bricks);

  /// Sets the fused cuboids of FusionKind::kGrowth, as of a copy; nothing happens with other kinds. Those that do not
  /// fit the voxels, or overlap earlier ones, are left out; voxels in none of them are single cells.
  ChangeSet setGrownCuboids(const std::vector<Cuboid>& cuboids);

  /// Exchanges all voxels and cuboids with another map, which may have been built while this one was
  /// in use. Locks stay; the revision of both rises. @complexity O(1).
  /// @throws std::invalid_argument  Resolution, fusion, its growth, environment, sensor model or order of the R-tree
  ///         differ; both maps are as they were.
  ChangeSet exchange(CuboidMap& other);

  /// Keeps clouds from changing the voxels of a box, known or not. replace() and exchange() still change them.
  /// @complexity O((k + 1) log n) for n locked boxes, k of which share a voxel with this one.
  void lock(const CellBox& box);
  /// Undoes lock() for the voxels of a box, whichever boxes they were locked with. @complexity As lock().
  void unlock(const CellBox& box);
  /// Locks the voxels of these boxes, and no others.
  void setLocked(const std::vector<CellBox>& boxes);
  /// The locked voxels.
  [[nodiscard]] const LockedBoxes& locked() const { return *locked_; }
  /// The locked voxels as disjoint boxes, by their least cells. @complexity O(n log n) for n boxes.
  [[nodiscard]] std::vector<CellBox> lockedBoxes() const;

  /// Sets the sensor model for later clouds. Log-odds stay as they are, also beyond new clamping thresholds,
  /// until a cloud updates them. With FusionKind::kGrowth, voxels that are no longer stable become single
  /// cells, in O(bricks with fused cuboids).
  /// @throws std::invalid_argument  as the constructor; nothing has changed then.
  ChangeSet setSensorModel(const SensorModelConfig& sensor_model);

  /// Forgets everything, locks too. @throws std::bad_alloc  Nothing has changed then.
  ChangeSet clear();

  /// The configuration of the constructor, with the current sensor model.
  [[nodiscard]] const MapConfig& config() const { return config_; }
  /// Converts between metres and cells.
  [[nodiscard]] const Grid& grid() const { return grid_; }
  /// Sensor model of the next cloud.
  [[nodiscard]] const SensorModel& sensorModel() const { return sensor_model_; }
  /// Revision. Rises with each call that changes a voxel or a cuboid, and with exchange() and clear().
  [[nodiscard]] std::uint64_t revision() const { return revision_; }
  /// The known voxels, always current.
  [[nodiscard]] const VoxelStore& voxels() const { return voxels_; }
  /// The R-tree with all cuboids; to be read through cuboid_search.h.
  [[nodiscard]] const CuboidTree& cuboids() const { return *cuboids_; }
  /// Box around all known voxels (MBR of the R-tree's root); nothing when none is known.
  /// @complexity O(M).
  [[nodiscard]] std::optional<CellBox> bounds() const;
  /// Bytes of voxels and cuboids held from the allocator, without locks. @complexity O(bricks).
  [[nodiscard]] std::size_t numBytes() const;

 private:
  [[nodiscard]] VoxelStore::Work work() const;
  ChangeSet edit(VoxelStore::PendingChange voxels);
  ChangeSet finish(bool is_changed, ChangeSet changes);

  MapConfig config_;
  Grid grid_;
  SensorModel sensor_model_;
  VoxelStore voxels_;
  std::unique_ptr<GrowthFusion> growth_;  ///< Null unless the fusion is kGrowth.
  std::unique_ptr<CuboidTree> cuboids_;
  std::unique_ptr<LockedBoxes> locked_;
  std::uint64_t revision_ = 0;
};

}  // namespace cuboid_mapping
