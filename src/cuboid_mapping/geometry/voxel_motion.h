// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/cell_box.h"

#include <Eigen/Geometry>

#include <optional>

namespace cuboid_mapping {

/// A rotation by multiples of 90 degrees about the axes with a shift by whole voxels: maps voxels to voxels.
class VoxelMotion {
 public:
  /// The motion of a transform, whose rotation fits within 1e-9 and shift within 1e-6 voxels.
  /// @param T_target_map  Metres. @return Nothing for other transforms, also for those that are not finite.
  [[nodiscard]] static std::optional<VoxelMotion> of(const Eigen::Isometry3d& T_target_map,
                                                     double resolution_m);

  /// The transform in units of voxels, with whole numbers.
  [[nodiscard]] const Eigen::Isometry3d& transform() const { return transform_; }

  /// The box after the motion, cut at kAllCells.
  [[nodiscard]] CellBox operator()(const CellBox& box) const;

 private:
  explicit VoxelMotion(const Eigen::Isometry3d& T_target_map) : transform_(T_target_map) {}

  Eigen::Isometry3d transform_;
};

}  // namespace cuboid_mapping
