// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/cuboid_tree.h"

#include "cuboid_mapping/geometry/box_faces.h"
#include "cuboid_mapping/geometry/grid.h"
#include "cuboid_mapping/rtree/traversal.h"
#include "cuboid_mapping/voxels/brick_store.h"

namespace cuboid_mapping {
namespace {

/// Calls visit(const Cuboid&) -> Visit for each of some voxels of a brick, as a single cell.
template <typename VisitT>
Visit visitVoxels(const VoxelBrick& brick, const BrickMask& voxels, CuboidFilter filter,
                  VisitT visit) {
  Visit answer = Visit::kContinue;
  const auto visit_class = [&](const BrickMask& mask, Occupancy occupancy) {
    mask.forEach([&](int voxel) {
      if (answer == Visit::kStop) return;
      answer = visit({CellBox::ofCell(cellAt(brick.brick, voxel)), occupancy});
    });
  };
  if (filter != CuboidFilter::kFree) {
    visit_class(brick.voxels.occupied() & voxels, Occupancy::kOccupied);
  }
  if (filter != CuboidFilter::kOccupied) {
    visit_class(brick.voxels.free() & voxels, Occupancy::kFree);
  }
  return answer;
}

/// The voxel of a box that is nearest to a point.
Cell nearestCell(const CellBox& box, const Eigen::Vector3d& point) {
  return floorOf(point.cwiseMax(toVector(box.min)).cwiseMin(toVector(box.max - Cell{1, 1, 1})));
}

}  // namespace

void CuboidTree::reserve(const VoxelStore& voxels, const VoxelStore::PendingChange& change) {
  if (change.num_new + change.num_gone == 0) return;
  inner_.reserve(change.num_new, change.num_gone, voxels.bricks().endIndex());
}

void CuboidTree::follow(const VoxelStore::PendingBrick& brick) noexcept {
  if (brick.is_gone) return inner_.remove(brick.index);
  if (!brick.has_other_branch) return;
  const Branch branch{brick.bounds, brick.has_occupied, brick.index};
  brick.is_new ? inner_.insert(branch) : inner_.update(branch);
}

/// Calls visit(const Cuboid&) -> Visit for each cuboid of a brick that passes the filter.
template <typename VisitT>
Visit CuboidTree::visitBrick(const Brick& brick, CuboidFilter filter, VisitT visit) const {
  if (grown_ != nullptr) {
    const GrownBrick* grown = grown_->find(brick.brick);
    if (grown == nullptr) return visitVoxels(brick, BrickMask::all(), filter, visit);
    for (const Cuboid& cuboid : grown->cuboids) {
      if (matches(filter, cuboid) && visit(cuboid) == Visit::kStop) return Visit::kStop;
    }
    return visitVoxels(brick, ~grown->fused, filter, visit);
  }
  const auto visit_box = [&](PackedBox box, Occupancy occupancy) {
    return visit(unpackCuboid(brick.brick, box, occupancy));
  };
  if (!brick.cuboids.isStale()) return brick.cuboids.visit(filter, visit_box);
  const DividedBrick divided = divide(brick.voxels.occupied(), brick.voxels.free());
  brick.cuboids.keep(divided);
  return BrickCuboids::visit(divided, filter, visit_box);
}

void CuboidTree::visitBox(const VoxelStore& voxels, const CellBox& window, CuboidFilter filter,
                          FunctionRef<Visit(const Cuboid&)> visit) const {
  const auto prefetch = [&voxels](NodeIndex leaf, int stage) {
    const Brick& brick = voxels.bricks().item(leaf);
    stage == 0 ? __builtin_prefetch(&brick) : brick.cuboids.prefetch();
  };
  visitLeaves(inner_, window, filter, prefetch, [&](NodeIndex leaf) {
    const Brick& brick = voxels.bricks().item(leaf);
    if (grown_ != nullptr) {  // A cuboid of several bricks is visited in its first one.
      return visitBrick(brick, filter, [&](const Cuboid& cuboid) {
        const CellBox part = intersect(cuboid.box, window);
        const bool is_first = !part.isEmpty() && brickOf(part.min) == brick.brick;
        return is_first ? visit(cuboid) : Visit::kContinue;
      });
    }
    if (window.contains(brickBox(brick.brick))) return visitBrick(brick, filter, visit);
    return visitBrick(brick, filter, [&](const Cuboid& cuboid) {
      return cuboid.box.intersects(window) ? visit(cuboid) : Visit::kContinue;
    });
  });
}

void CuboidTree::visitNearest(const VoxelStore& voxels, const Eigen::Vector3d& point,
                              double max_distance, CuboidFilter filter,
                              FunctionRef<Visit(const Cuboid&, double)> visit) const {
  const auto read_leaf = [&](NodeIndex leaf, const auto& push) {
    const Brick& brick = voxels.bricks().item(leaf);
    (void)visitBrick(brick, filter, [&](const Cuboid& cuboid) {
      // A cuboid of several bricks is pushed in the nearest one.
      const bool is_nearest =
          grown_ == nullptr || brickOf(nearestCell(cuboid.box, point)) == brick.brick;
      if (is_nearest) push(cuboid);
      return Visit::kContinue;
    });
  };
  cuboid_mapping::visitNearest(inner_, point, max_distance, filter, read_leaf, visit);
}

}  // namespace cuboid_mapping
