// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/geometry/voxel_motion.h"

#include "cuboid_mapping/geometry/box_faces.h"
#include "cuboid_mapping/geometry/grid.h"

namespace cuboid_mapping {
namespace {

constexpr double kTurnTolerance = 1e-9;
constexpr double kShiftTolerance = 1e-6;  // In voxels.

/// @param corner  Of voxels.
Cell toCell(const Eigen::Vector3d& corner) {
  return floorOf(corner.cwiseMax(-Grid::kMaxCell).cwiseMin(Grid::kMaxCell));
}

}  // namespace

std::optional<VoxelMotion> VoxelMotion::of(const Eigen::Isometry3d& T_target_map,
                                           double resolution_m) {
  const Eigen::Matrix3d turn = T_target_map.linear();
  const Eigen::Vector3d shift = T_target_map.translation() / resolution_m;
  if (!turn.allFinite() || !shift.allFinite()) return std::nullopt;
  Eigen::Isometry3d whole = Eigen::Isometry3d::Identity();
  whole.linear() = turn.array().round();
  whole.translation() = shift.array().round();
  const bool is_whole = (turn - whole.linear()).cwiseAbs().maxCoeff() <= kTurnTolerance &&
                        (shift - whole.translation()).cwiseAbs().maxCoeff() <= kShiftTolerance &&
                        whole.linear().isUnitary() && whole.linear().determinant() > 0.0;
  return is_whole ? std::optional<VoxelMotion>(VoxelMotion(whole)) : std::nullopt;
}

CellBox VoxelMotion::operator()(const CellBox& box) const {
  const Eigen::Vector3d a = transform_ * toVector(box.min);
  const Eigen::Vector3d b = transform_ * toVector(box.max);
  return {toCell(a.cwiseMin(b)), toCell(a.cwiseMax(b))};
}

}  // namespace cuboid_mapping
