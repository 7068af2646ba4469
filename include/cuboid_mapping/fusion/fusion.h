// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/occupancy/cuboid.h"
#include "cuboid_mapping/rtree/rtree.h"
#include "cuboid_mapping/voxels/change_set.h"
#include "cuboid_mapping/voxels/voxel_store.h"

#include <cstddef>
#include <vector>

namespace cuboid_mapping {

/// A brick whose cuboids in the R-tree are old.
struct WaitingBrick {
  Cell brick;
  std::uint64_t cloud = 0;  ///< The last one that has given a voxel of it another class.
};

/// How voxels become cuboids (the paper's adaptation of the grid cell resolution), and the R-tree
/// that holds these: the one interface of all back-ends.
///
/// A back-end may let bricks wait. Their cuboids in the tree are old then, and divide() says what they
/// are now: it gives what fuse() would put into the tree, so that nobody who asks both sees the
/// difference. Const functions may run side by side; a change needs exclusive access.
class Fusion {
 public:
  explicit Fusion(const RTreeConfig& rtree) : tree_(rtree) {}
  Fusion(const Fusion&) = delete;
  Fusion& operator=(const Fusion&) = delete;
  virtual ~Fusion() = default;

  /// Takes note of what a cloud has changed. @param changes  Gets the bricks that have new cuboids.
  virtual void noteCloud(const VoxelStore& voxels, const ScanUpdate& update,
                         const std::vector<BrickChange>& changed, ChangeSet& changes) = 0;
  /// Takes note of what was changed otherwise.
  virtual void noteEdit(const VoxelStore& voxels, const std::vector<BrickChange>& changed,
                        ChangeSet& changes) = 0;
  /// Takes note of other clamping thresholds.
  virtual void setSensorModel(const VoxelStore& voxels, const SensorModel& model,
                              ChangeSet& changes) = 0;

  /// Puts the cuboids of waiting bricks into the tree, those first that have waited longest.
  /// @param max_bricks  After so many it is left to another call to go on.
  virtual void fuse(const VoxelStore& voxels, std::size_t max_bricks) = 0;

  /// The cuboids of one brick, appended. @pre The brick waits.
  virtual void divide(const VoxelBrick& brick, std::vector<Cuboid>& cuboids) const = 0;

  virtual void clear() {
    tree_.clear();
    waiting_.clear();
  }

  /// Bytes held from the allocator.
  [[nodiscard]] virtual std::size_t numBytes() const {
    return tree_.numBytes() + waiting_.numBytes();
  }

  /// Of waiting bricks, what is in the tree is old.
  [[nodiscard]] const RTree& tree() const { return tree_; }
  [[nodiscard]] const BrickTable<WaitingBrick>& waiting() const { return waiting_; }

 protected:
  RTree tree_;                        // NOLINT: for the back-ends
  BrickTable<WaitingBrick> waiting_;  // NOLINT
};

}  // namespace cuboid_mapping
