// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/brick.h"
#include "cuboid_mapping/geometry/page.h"
#include "cuboid_mapping/geometry/voxel_motion.h"
#include "cuboid_mapping/scan/brick_update.h"

#include <cstddef>
#include <cstdint>
#include <unordered_map>

namespace cuboid_mapping {

/// Void voxels: they were certainly empty once, so that an object seen in them at any time has moved. After
/// DUFOMap (Duberg, Zhang, Jia and Jensfelt, 2024), cloud by cloud.
///
/// A voxel becomes void if the beams of one cloud pass it and all of its 26 neighbours, and end in none of
/// them. The neighbours protect surfaces against slightly wrong poses and ranges, and beams that graze them. A
/// void voxel stays void until it is forgotten. Not thread-safe.
class VoidSpace {
 public:
  /// Adds a cloud's observations. @complexity O(bricks of the update).
  void add(const ScanUpdate& update);

  /// Forgets pages (page.h) that share no voxel with a box, and that none of the last `idle_clouds` clouds has
  /// touched.
  /// @complexity O(pages with void voxels).
  void forgetOutside(const CellBox& box, std::uint64_t idle_clouds);

  /// Number of bricks with void voxels.
  [[nodiscard]] std::size_t numBricks() const { return bricks_.size(); }

  /// Number of bricks that add() has looked up by hash so far. For tests of its cost.
  [[nodiscard]] std::size_t numLookUps() const { return num_look_ups_; }

  /// The void voxels of a brick.
  [[nodiscard]] BrickMask of(const Cell& brick) const {
    const auto found = bricks_.find(brick);
    return found == bricks_.end() ? BrickMask() : found->second;
  }
  /// Whether a voxel is void.
  [[nodiscard]] bool contains(const Cell& cell) const {
    return of(brickOf(cell)).test(voxelIndex(cell));
  }

  /// A cloud's update without its hits in void voxels, which then are not observed.
  [[nodiscard]] ScanUpdate withoutMoving(const ScanUpdate& update) const;

  /// The void space in another frame. @complexity O(void voxels).
  [[nodiscard]] VoidSpace moved(const VoxelMotion& motion) const;

  /// Calls visit(brick, mask) for each brick with void voxels, in no order.
  template <typename VisitorT>
  void forEach(VisitorT visit) const {
    for (const auto& [brick, mask] : bricks_) visit(brick, mask);
  }

 private:
  void touch(const ScanUpdate& update);

  std::unordered_map<Cell, BrickMask, CellHash> bricks_;
  std::unordered_map<Cell, std::uint64_t, CellHash> pages_;  ///< Last cloud that touched each page.
  std::uint64_t num_clouds_ = 0;
  std::size_t num_look_ups_ = 0;
};

}  // namespace cuboid_mapping
