// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/fusion/cuboid_tree.h"

namespace cuboid_mapping {

/// Fusion by class inside bricks, or none: the leaf nodes of the R-tree are the bricks, each with its cuboids
/// and their tight MBR. The cuboids of a brick are a function of the classes of its voxels alone: they do not
/// depend on the order of clouds and reads, on threads, or on the tree.
///
/// Readers divide a brick whose cuboids are stale. The MBR of a brick is that of its known voxels: the tree is
/// never stale.
class ClassFusion : public CuboidTree {
 public:
  /// @param is_fused  If false, every voxel is a cuboid.
  ClassFusion(const RTreeConfig& rtree, bool is_fused) : inner_(rtree), is_fused_(is_fused) {}

  /// Reserves memory for a change. @param voxels  Have memory reserved for the change.
  /// @throws std::bad_alloc  Nothing has changed then.
  void reserve(const VoxelStore& voxels, const VoxelStore::PendingChange& change);
  /// Follows the committed change of a brick. @pre Memory is reserved.
  void follow(const VoxelStore::PendingBrick& brick) noexcept;
  /// Frees reserved memory that is not needed.
  void trim() noexcept { inner_.trim(); }

  void visitBox(const VoxelStore& voxels, const CellBox& window, CuboidFilter filter,
                CuboidVisitor visit) const override;
  void visitNearest(const VoxelStore& voxels, const Eigen::Vector3d& point, double max_distance,
                    CuboidFilter filter, DistanceVisitor visit) const override;
  [[nodiscard]] const InnerTree& inner() const override { return inner_; }
  [[nodiscard]] std::size_t numLeafNodes(const VoxelStore& voxels) const override {
    return voxels.size();
  }
  [[nodiscard]] std::size_t numBytes() const override { return inner_.numBytes(); }

 private:
  template <typename VisitT>
  Visit visitBrick(const Brick& brick, CuboidFilter filter, VisitT visit) const;

  InnerTree inner_;
  bool is_fused_;
};

}  // namespace cuboid_mapping
