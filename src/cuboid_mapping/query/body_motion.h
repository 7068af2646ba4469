// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/query/body_probe.h"

namespace cuboid_mapping {

/// A straight motion of a body's origin, with an even turn about one axis.
class BodyMotion {
 public:
  BodyMotion(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to);

  [[nodiscard]] double length() const { return shift_map_.norm(); }
  /// Whether it is half a turn, which could go either way.
  [[nodiscard]] bool isHalfTurn() const;
  /// The pose after a part of the motion, 0 to 1.
  [[nodiscard]] Eigen::Isometry3d at(double part) const;
  /// The sway of the body in the part [middle - half, middle + half]. @param T_map_body  at(middle).
  [[nodiscard]] Sway swayAround(const Eigen::Isometry3d& T_map_body, double half) const;
  /// Upper bound of the path length of any point of the body, metres. @param reach_m  Reach of the body.
  [[nodiscard]] double travel(double reach_m) const { return length() + angle_ * reach_m; }

 private:
  Eigen::Isometry3d from_;
  Eigen::Vector3d shift_map_;
  Eigen::Vector3d axis_body_;
  double angle_;
};

/// The first contact of a motion.
struct FirstContact {
  double part;  ///< Free part of the motion, 0 to 1.
  PoseContact contact;
};

/// The first contact; nothing if there is none, or if the budget of the probe is spent. Halves the motion until
/// the body, enlarged by its sway, is free, or until the sway is at most kMotionTolerance.
[[nodiscard]] std::optional<FirstContact> findFirst(BodyProbe& probe, const BodyMotion& motion);

/// Whether a motion is known to meet nothing: not half a turn, and the budget of the probe is not spent.
[[nodiscard]] bool isFree(BodyProbe& probe, const BodyMotion& motion);

}  // namespace cuboid_mapping
