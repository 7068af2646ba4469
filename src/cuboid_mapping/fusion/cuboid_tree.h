// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/function_ref.h"
#include "cuboid_mapping/occupancy/cuboid_filter.h"
#include "cuboid_mapping/rtree/inner_tree.h"
#include "cuboid_mapping/voxels/voxel_store.h"

#include <Eigen/Core>

#include <cstddef>

namespace cuboid_mapping {

/// Visitors of a search: called for each cuboid, or for each cuboid with its distance in cells.
///@{
using CuboidVisitor = FunctionRef<Visit(const Cuboid&)>;
using DistanceVisitor = FunctionRef<Visit(const Cuboid&, double)>;
///@}

/// The R-tree with the cuboids of a map, for readers. `voxels` are always those of the map that has the tree.
/// Const functions may run side by side, not beside a change.
class CuboidTree {
 public:
  CuboidTree() = default;
  CuboidTree(const CuboidTree&) = delete;
  CuboidTree& operator=(const CuboidTree&) = delete;
  virtual ~CuboidTree() = default;

  /// See cuboid_search.h.
  ///@{
  virtual void visitBox(const VoxelStore& voxels, const CellBox& window, CuboidFilter filter,
                        CuboidVisitor visit) const = 0;
  virtual void visitNearest(const VoxelStore& voxels, const Eigen::Vector3d& point,
                            double max_distance, CuboidFilter filter,
                            DistanceVisitor visit) const = 0;
  ///@}
  /// The nodes above the leaf nodes.
  [[nodiscard]] virtual const InnerTree& inner() const = 0;
  /// Number of leaf nodes.
  [[nodiscard]] virtual std::size_t numLeafNodes(const VoxelStore& voxels) const = 0;
  /// Bytes held from the allocator, without the bricks.
  [[nodiscard]] virtual std::size_t numBytes() const = 0;
};

}  // namespace cuboid_mapping
