// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>

namespace cuboid_mapping {

/// Rounds to nine decimals. tf returns its newest pose unchanged, but interpolates the same pose once there is
/// a later one. The last bits may then differ: enough to move a sensor at the height of a voxel face into
/// another voxel.
[[nodiscard]] inline Eigen::Isometry3d roundTransform(const Eigen::Isometry3d& transform) {
  Eigen::Isometry3d rounded;
  rounded.matrix() = (transform.matrix() * 1e9).array().round().matrix() / 1e9;
  return rounded;
}

}  // namespace cuboid_mapping
