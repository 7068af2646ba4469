// SPDX-License-Identifier: BSD-3-Clause
// Obstacles for the Flexible Collision Library (FCL) 0.6 or later; in the library cuboid_mapping_fcl, which is
// built if FCL is installed.
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"

#include <fcl/broadphase/broadphase_dynamic_AABB_tree.h>
#include <fcl/narrowphase/collision_object.h>

#include <memory>
#include <vector>

namespace cuboid_mapping {

/// The occupied cuboids of a region as collision objects: solid boxes, in a broad-phase tree. A copy:
/// the map may change afterwards. Metres, map frame. Not thread-safe, as the tree is not.
class FclObstacles {
 public:
  /// @param region  Takes all cuboids that share a voxel with it, unclipped. @complexity O(k log k) for k
  ///                cuboids.
  FclObstacles(const CuboidMap& map, const CellBox& region);

  /// The tree, for fcl's collide() and distance() with a callback.
  [[nodiscard]] fcl::BroadPhaseCollisionManagerd& manager() { return manager_; }
  /// Number of cuboids.
  [[nodiscard]] std::size_t size() const { return objects_.size(); }

  /// Whether an object meets any of the cuboids.
  [[nodiscard]] bool collides(fcl::CollisionObjectd& object);

  /// Distance of an object from the nearest cuboid, 0 if they meet; infinity when there is none.
  [[nodiscard]] double computeDistance_m(fcl::CollisionObjectd& object);

 private:
  std::vector<std::unique_ptr<fcl::CollisionObjectd>> objects_;
  fcl::DynamicAABBTreeCollisionManagerd manager_;
};

}  // namespace cuboid_mapping
