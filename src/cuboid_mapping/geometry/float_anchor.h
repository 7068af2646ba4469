// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace cuboid_mapping {

/// Distance from the origin beyond which float32 steps are wider than 0.5 mm.
constexpr double kMaxFloatRange_m = 8192.0;

/// Anchor of points near a reference, as float32: zero, or beyond kMaxFloatRange_m a multiple of 1024 m.
/// @param reference  Metres. With a NaN, the anchor is zero.
[[nodiscard]] inline Eigen::Vector3d floatAnchor(const Eigen::Vector3d& reference) {
  constexpr double kSpacing_m = 1024.0;
  if (!(reference.cwiseAbs().maxCoeff() > kMaxFloatRange_m)) return Eigen::Vector3d::Zero();
  return (reference / kSpacing_m).array().round().matrix() * kSpacing_m;
}

}  // namespace cuboid_mapping
