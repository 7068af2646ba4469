// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/class_fusion.h"

#include "cuboid_mapping/rtree/traversal.h"
#include "cuboid_mapping/voxels/brick_store.h"

namespace cuboid_mapping {
namespace {

/// Calls visit(const Cuboid&) -> Visit for each voxel of a brick.
template <typename VisitT>
Visit visitVoxels(const VoxelBrick& brick, CuboidFilter filter, VisitT visit) {
  Visit answer = Visit::kContinue;
  const auto visit_class = [&](const BrickMask& mask, Occupancy occupancy) {
    mask.forEach([&](int voxel) {
      if (answer == Visit::kStop) return;
      answer = visit({CellBox::ofCell(cellAt(brick.brick, voxel)), occupancy});
    });
  };
  if (filter != CuboidFilter::kFree) visit_class(brick.voxels.occupied(), Occupancy::kOccupied);
  if (filter != CuboidFilter::kOccupied) visit_class(brick.voxels.free(), Occupancy::kFree);
  return answer;
}

}  // namespace

void ClassFusion::reserve(const VoxelStore& voxels, const VoxelStore::PendingChange& change) {
  if (change.num_new + change.num_gone == 0) return;
  inner_.reserve(change.num_new, change.num_gone, voxels.bricks().endIndex());
}

void ClassFusion::follow(const VoxelStore::PendingBrick& brick) noexcept {
  if (brick.is_gone) return inner_.remove(brick.index);
  if (!brick.has_other_branch) return;
  const Branch branch{brick.bounds, brick.has_occupied, brick.index};
  brick.is_new ? inner_.insert(branch) : inner_.update(branch);
}

/// Calls visit(const Cuboid&) -> Visit for each cuboid of a brick that passes the filter.
template <typename VisitT>
Visit ClassFusion::visitBrick(const Brick& brick, CuboidFilter filter, VisitT visit) const {
  if (!is_fused_) return visitVoxels(brick, filter, visit);
  const auto visit_box = [&](PackedBox box, Occupancy occupancy) {
    return visit(unpackCuboid(brick.brick, box, occupancy));
  };
  if (!brick.cuboids.isStale()) return brick.cuboids.visit(filter, visit_box);
  const DividedBrick divided = divide(brick.voxels.occupied(), brick.voxels.free());
  brick.cuboids.keep(divided);
  return BrickCuboids::visit(divided, filter, visit_box);
}

void ClassFusion::visitBox(const VoxelStore& voxels, const CellBox& window, CuboidFilter filter,
                           CuboidVisitor visit) const {
  const auto prefetch = [&voxels](NodeIndex leaf, int stage) {
    const Brick& brick = voxels.bricks().item(leaf);
    stage == 0 ? __builtin_prefetch(&brick) : brick.cuboids.prefetch();
  };
  visitLeaves(inner_, window, filter, prefetch, [&](NodeIndex leaf) {
    const Brick& brick = voxels.bricks().item(leaf);
    if (window.contains(brickBox(brick.brick))) return visitBrick(brick, filter, visit);
    return visitBrick(brick, filter, [&](const Cuboid& cuboid) {
      return cuboid.box.intersects(window) ? visit(cuboid) : Visit::kContinue;
    });
  });
}

void ClassFusion::visitNearest(const VoxelStore& voxels, const Eigen::Vector3d& point,
                               double max_distance, CuboidFilter filter,
                               DistanceVisitor visit) const {
  const auto read_leaf = [&](NodeIndex leaf, const auto& push) {
    (void)visitBrick(voxels.bricks().item(leaf), filter, [&](const Cuboid& cuboid) {
      push(cuboid);
      return Visit::kContinue;
    });
  };
  cuboid_mapping::visitNearest(inner_, point, max_distance, filter, read_leaf, visit);
}

}  // namespace cuboid_mapping
