// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace cuboid_mapping {

/// Distance from the origin beyond which float32 steps are wider than 0.5 mm.
constexpr double kMaxFloatRange_m = 8192.0;

/// Distance between anchors.
constexpr double kAnchorSpacing_m = 1024.0;

/// Anchor of points near a reference, as float32: zero, or beyond kMaxFloatRange_m a multiple of 1024 m.
/// @param reference  Metres. With a NaN, the anchor is zero.
[[nodiscard]] inline Eigen::Vector3d floatAnchor(const Eigen::Vector3d& reference) {
  if (!(reference.array().abs() > kMaxFloatRange_m).any() || reference.hasNaN())
    return Eigen::Vector3d::Zero();
  return (reference / kAnchorSpacing_m).array().round().matrix() * kAnchorSpacing_m;
}

}  // namespace cuboid_mapping
