// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/fusion/dense_brick.h"
#include "cuboid_mapping/geometry/brick.h"
#include "cuboid_mapping/map/change_set.h"
#include "cuboid_mapping/map/map_content.h"
#include "cuboid_mapping/map/voxel_classes.h"
#include "cuboid_mapping/rtree/rtree.h"

#include <array>
#include <cstdint>
#include <vector>

namespace cuboid_mapping {

/// A brick with the cuboids that are to be in it.
struct BrickPartition {
  Cell brick;
  std::vector<Cuboid> cuboids;
};

/// Brings bricks into the R-tree. Keeps its buffers from one call to the next.
class TreeWriter {
 public:
  using Partitions = std::vector<BrickPartition>;

  /// Puts the cuboids of bricks in the place of what the tree holds there.
  ///
  /// A cuboid that comes out as it was stays where it is. One that reaches beyond the bricks is cut
  /// at their faces.
  ///
  /// @param first, last  Bricks of one group, each once, not none.
  /// @param changes  Gets the boxes whose cuboids have changed.
  /// @param content, classes  Are kept up with the tree.
  void write(Partitions::const_iterator first, Partitions::const_iterator last, RTree& tree,
             ChangeSet& changes, MapContent& content, VoxelClasses& classes);

  /// Brings voxels up to date cell by cell, and leaves all other cuboids as they are: a voxel that
  /// is new or has another value becomes a cuboid of its own; a cuboid in which it was is split
  /// around it, at the resolution of the grid (paper, Section VI).
  ///
  /// @param bricks  Of one group, each once, not none.
  /// @param changes, content, classes  As in write().
  /// @return What has changed, for each brick in which something has.
  std::vector<BrickChange> update(const std::vector<const DenseBrick*>& bricks, RTree& tree,
                                  ChangeSet& changes, MapContent& content, VoxelClasses& classes);

 private:
  /// A voxel that does not have the value of the cuboid any more in which it is.
  struct Contradiction {
    std::uint32_t member;  ///< Of selection_.
    Cell cell;
  };

  void selectMembers(const CellBox& window, const RTree& tree);
  [[nodiscard]] bool compare(const BrickPartition& partition);
  void cutOutside(const std::vector<CellBox>& changed);
  [[nodiscard]] BrickChange compareVoxels(const DenseBrick& brick);
  void splitMembers(ChangeSet& changes);
  void replaceInTree(RTree& tree, MapContent& content);

  Selection selection_;
  std::array<std::vector<std::uint32_t>, kGroupBricks> members_;  ///< Of selection_, by brick.
  std::vector<std::uint32_t> crossing_;  ///< Of selection_: cuboids that reach beyond one brick.
  std::vector<char> is_removed_;         ///< Of selection_.
  std::vector<Cuboid> added_;
  std::vector<Contradiction> contradictions_;
};

}  // namespace cuboid_mapping
