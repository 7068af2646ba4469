// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>

namespace cuboid_mapping {

/// Rounds to nine decimals; a pose with fewer stays as it is. tf returns its newest pose unchanged, but interpolates it once
/// there is a later one, which may change the last bits: enough to lift a sensor that is level
/// with a face of voxels.
[[nodiscard]] inline Eigen::Isometry3d roundTransform(const Eigen::Isometry3d& transform) {
  Eigen::Isometry3d rounded;
  rounded.matrix() = (transform.matrix() * 1e9).array().round().matrix() / 1e9;
  return rounded;
}

}  // namespace cuboid_mapping
