// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/fusion/dense_brick.h"
#include "cuboid_mapping/fusion/search_directions.h"
#include "cuboid_mapping/fusion/settling_cells.h"
#include "cuboid_mapping/map/voxel_classes.h"
#include "cuboid_mapping/occupancy/sensor_model.h"
#include "cuboid_mapping/rtree/rtree.h"
#include "cuboid_mapping/scan/beam_samples.h"

#include <cstdint>
#include <optional>
#include <unordered_set>
#include <vector>

namespace cuboid_mapping {

/// Which cells start to grow after a cloud (the paper's set T).
enum class GrowthStarters : unsigned char {
  kSampled,  ///< Those in which a beam ends, and those drawn at random along the beams: the paper.
  kEndPoints,  ///< Those in which a beam ends.
  kChanged,    ///< All whose value the cloud has changed.
};

/// "sampled", "end_points" or "changed".
[[nodiscard]] const char* toString(GrowthStarters starters);

/// Parameters of the fusion of the paper, Section IV-B.
struct GrowthConfig {
  GrowthStep step = GrowthStep::kCell;
  SearchStrategy search;
  GrowthStarters starters = GrowthStarters::kSampled;
  BeamSampling sampling{0.1, 1};  ///< Of kSampled; its seed is that of a random search, too.
  int settle_clouds = 10;         ///< That a voxel split out of a cuboid waits before it may fuse.
};

/// One successful growth: a cell and what it has absorbed.
struct Fused {
  Cuboid cuboid;
  std::size_t num_absorbed;  ///< Cells that have gone: its own, and those it has absorbed.
};

/// Adaptation of the cell resolution by growth (paper, Section IV-B and Figure 5): a stable cell
/// expands in one search direction after the other; an expansion succeeds when the slab that it
/// adds is wholly tiled by cells that lie inside it (6) and are stable in the same class (7), (8).
/// They are removed from the R-tree, and the fused cuboid is inserted.
///
/// The fused cuboid has the mean probability of its voxels; where they are all clamped to the same
/// threshold, that is their own. The result does not depend on the order (d, M) of the R-tree. Not
/// thread-safe.
class GrowthFusion {
 public:
  GrowthFusion(const GrowthConfig& config, const SensorModel& sensor_model);

  /// Takes note of what has been written to the R-tree.
  /// @param cloud  Number of the cloud, which never falls.
  void note(const DenseBrick& brick, const BrickChange& change, std::uint64_t cloud);

  /// Takes note of boxes whose cuboids have changed otherwise. @complexity O(bricks and cuboids in
  /// the boxes).
  void noteEdits(const std::vector<CellBox>& boxes, const RTree& tree);

  /// Lets the starters grow, and grow again, until none of them can.
  ///
  /// In one pass every starter is tried once; those beside something that has fused are tried again
  /// in the next one.
  /// @param observed  Cells of T: end points and samples; not looked at with kChanged.
  /// @return What has been fused; every cuboid that is in the tree at the end, and some that have
  ///         been absorbed on the way.
  std::vector<Fused> fuse(const std::vector<Cell>& observed, std::uint64_t cloud, RTree& tree);

  void clear();

  /// Bytes held from the allocator, without those of cells that settle.
  [[nodiscard]] std::size_t numBytes() const { return fusible_.numBytes(); }

 private:
  struct Growth;

  void setFusible(const Cell& brick, const BrickMask& stable, const BrickMask& occupied);
  [[nodiscard]] std::vector<Cell> releaseSettled(std::uint64_t cloud, const RTree& tree);
  void tryCell(const Cell& cell, RTree& tree, std::vector<Fused>& fused);
  [[nodiscard]] bool expand(Growth& growth, const RTree& tree) const;
  [[nodiscard]] bool expandMost(Growth& growth, const RTree& tree) const;
  [[nodiscard]] std::optional<CellBox> findSlab(SearchDirection direction, const Growth& growth,
                                                const RTree& tree) const;
  [[nodiscard]] bool absorb(SearchDirection direction, Growth& growth, const RTree& tree) const;
  [[nodiscard]] SearchDirections directionsOf(const CellBox& box) const;
  [[nodiscard]] std::vector<Cell> findStartersBeside(const std::vector<Fused>& fused,
                                                     std::size_t first, const RTree& tree) const;

  using Cells = std::unordered_set<Cell, CellHash>;

  GrowthConfig config_;
  SensorModel sensor_model_;
  VoxelClasses fusible_;  ///< Stable voxels that do not settle, with their class.
  SettlingCells settling_;
  std::vector<Cell> changed_;  ///< Since the last fuse(), with kChanged.
  Cells starters_;             ///< Least cells of cuboids that are in T.
  Cells tried_;                ///< Those of them that could not grow in this pass.
};

}  // namespace cuboid_mapping
