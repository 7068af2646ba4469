// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/occupancy/cuboid.h"
#include "cuboid_mapping/rtree/rtree.h"
#include "cuboid_mapping/voxels/change_set.h"
#include "cuboid_mapping/voxels/voxel_store.h"

#include <cstddef>
#include <new>
#include <vector>

namespace cuboid_mapping {

/// A brick whose cuboids in the R-tree are old.
struct WaitingBrick {
  Cell brick;               ///< Its least cell.
  std::uint64_t cloud = 0;  ///< The last one that has given a voxel of it another class.
};

/// How voxels become cuboids (the paper's adaptation of the grid cell resolution), and the R-tree
/// that holds these: the one interface of all back-ends.
///
/// A back-end may let bricks wait. Their cuboids in the tree are old then, and divide() says what they
/// are now: it gives what fuse() would put into the tree, so that nobody who asks both sees the
/// difference.
///
/// The tree holds nothing that the voxels do not say. When memory runs out while it changes, it is
/// emptied, and all bricks wait until there is memory again. Const functions may run side by side; a
/// change needs exclusive access.
class Fusion {
 public:
  /// An empty tree; no brick waits. @pre `rtree` is as RTree takes it.
  explicit Fusion(const RTreeConfig& rtree) : tree_(rtree) {}
  Fusion(const Fusion&) = delete;
  Fusion& operator=(const Fusion&) = delete;
  virtual ~Fusion() = default;

  /// Takes note of what is about to change. @param changes  Gets bricks that will have new cuboids.
  /// @throws std::bad_alloc  The change must not be made then.
  virtual void announce(const std::vector<BrickChange>& changed, ChangeSet& changes) = 0;
  /// Follows a cloud that was announced. @param changes  Gets more bricks that have new cuboids.
  virtual void noteCloud(const VoxelStore& voxels, const ScanUpdate& update,
                         const std::vector<BrickChange>& changed, ChangeSet& changes) noexcept = 0;
  /// Follows another change that was announced.
  virtual void noteEdit(const VoxelStore& voxels, const std::vector<BrickChange>& changed,
                        ChangeSet& changes) noexcept = 0;
  /// Follows other clamping thresholds.
  virtual void setSensorModel(const VoxelStore& voxels, const SensorModel& model,
                              ChangeSet& changes) noexcept = 0;

  /// Puts the cuboids of waiting bricks into the tree, those first that have waited longest.
  /// @param max_bricks  After so many it is left to another call to go on.
  /// @throws std::bad_alloc  All bricks wait then.
  virtual void fuse(const VoxelStore& voxels, std::size_t max_bricks) = 0;

  /// The cuboids of one brick, appended. @pre The brick waits.
  virtual void divide(const VoxelBrick& brick, std::vector<Cuboid>& cuboids) const = 0;

  /// Forgets all cuboids: the tree is empty, and no brick waits.
  virtual void clear() noexcept {
    tree_.clear();
    waiting_.clear();
    do_all_wait_ = false;
  }

  /// Bytes held from the allocator.
  [[nodiscard]] virtual std::size_t numBytes() const {
    return tree_.numBytes() + waiting_.numBytes();
  }

  /// Of waiting bricks, what is in the tree is old.
  [[nodiscard]] const RTree& tree() const { return tree_; }
  /// Whether the tree is old in some brick.
  [[nodiscard]] bool isAnyWaiting() const { return do_all_wait_ || !waiting_.isEmpty(); }
  /// Whether the tree is old in a brick; of one without a known voxel it may say so, too.
  /// @param brick  Its least cell.
  [[nodiscard]] bool isWaiting(const Cell& brick) const {
    return do_all_wait_ || waiting_.find(brick) != nullptr;
  }
  /// Calls visit(const VoxelBrick&) for each waiting brick that shares a cell with a box and has a
  /// known voxel. @complexity O(waiting bricks, or those of the box if these are fewer).
  template <typename VisitorT>
  void forEachWaiting(const VoxelStore& voxels, const CellBox& box, VisitorT visit) const {
    if (do_all_wait_) return voxels.forEachIn(box, visit);
    waiting_.forEachIn(box, [&](const WaitingBrick& waiting) {
      if (const VoxelBrick* brick = voxels.findBrick(waiting.brick)) visit(*brick);
    });
  }
  /// Bricks that wait. @param voxels  Of the map.
  [[nodiscard]] std::size_t numWaiting(const VoxelStore& voxels) const {
    return do_all_wait_ ? voxels.size() : waiting_.size();
  }

 protected:
  /// Does work on the tree. When memory fails in it, the tree is emptied, and all bricks wait: its
  /// cuboids are to be made of the voxels again. @return Whether the work is done.
  template <typename WorkT>
  [[nodiscard]] bool changeTree(const WorkT& work) {
    try {
      work();
      return true;
    } catch (const std::bad_alloc&) {
      clear();
      do_all_wait_ = true;
      return false;
    }
  }

  /// The cuboids; which bricks wait, unless all do; whether all do.
  ///@{
  RTree tree_;                        // NOLINT: for the back-ends
  BrickTable<WaitingBrick> waiting_;  // NOLINT
  bool do_all_wait_ = false;          // NOLINT
  ///@}
};

}  // namespace cuboid_mapping
