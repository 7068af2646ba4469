// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/fusion/grown_bricks.h"
#include "cuboid_mapping/geometry/function_ref.h"
#include "cuboid_mapping/occupancy/cuboid_filter.h"
#include "cuboid_mapping/rtree/inner_tree.h"
#include "cuboid_mapping/voxels/voxel_store.h"

#include <Eigen/Core>

#include <cstddef>

namespace cuboid_mapping {

/// The R-tree of a map: its leaf nodes are the bricks, each with the tight MBR of its known voxels. Leaf branches are
/// the cuboids of the brick; a grown cuboid is one of each brick that it shares a voxel with.
///
/// `voxels` are always those of the map that has the tree. Const functions may run side by side, not beside a
/// change.
class CuboidTree {
 public:
  /// @param grown  The fused cuboids: all other voxels are single cells. Null: the cuboids are those into which the voxels
  ///               of a brick are divided by class; a reader divides stale ones. Must outlive the tree.
  CuboidTree(const RTreeConfig& rtree, const GrownBricks* grown) : inner_(rtree), grown_(grown) {}

  /// Reserves memory for a change. @param voxels  Have memory reserved for the change.
  /// @throws std::bad_alloc  Nothing has changed then.
  void reserve(const VoxelStore& voxels, const VoxelStore::PendingChange& change);
  /// Follows the committed change of a brick. @pre Memory is reserved.
  void follow(const VoxelStore::PendingBrick& brick) noexcept;
  /// Frees reserved memory that is not needed.
  void trim() noexcept { inner_.trim(); }

  /// See cuboid_search.h. Each cuboid is visited once.
  ///@{
  void visitBox(const VoxelStore& voxels, const CellBox& window, CuboidFilter filter,
                FunctionRef<Visit(const Cuboid&)> visit) const;
  void visitNearest(const VoxelStore& voxels, const Eigen::Vector3d& point, double max_distance,
                    CuboidFilter filter, FunctionRef<Visit(const Cuboid&, double)> visit) const;
  ///@}
  /// The nodes above the leaf nodes.
  [[nodiscard]] const InnerTree& inner() const { return inner_; }
  /// Argument of the constructor.
  [[nodiscard]] const GrownBricks* grown() const { return grown_; }

 private:
  template <typename VisitT>
  Visit visitBrick(const Brick& brick, CuboidFilter filter, VisitT visit) const;

  InnerTree inner_;
  const GrownBricks* grown_;
};

}  // namespace cuboid_mapping
