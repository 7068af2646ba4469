// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>

namespace cuboid_mapping {

/// To nine decimals, so that a pose with fewer stays what it is. tf gives a pose as it came while it is the newest, and
/// interpolates as soon as there is a later one, which may change its last bits: enough to lift a sensor that is level
/// with a face of voxels.
[[nodiscard]] inline Eigen::Isometry3d roundTransform(const Eigen::Isometry3d& transform) {
  Eigen::Isometry3d rounded;
  rounded.matrix() = (transform.matrix() * 1e9).array().round().matrix() / 1e9;
  return rounded;
}

}  // namespace cuboid_mapping
