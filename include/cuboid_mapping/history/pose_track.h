// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/isometry.h"

#include <cstdint>
#include <vector>

namespace cuboid_mapping {

/// Pose of a body at a time.
struct StampedPose {
  std::int64_t stamp_ns = 0;                                     ///< Stamp since 1970.
  Eigen::Isometry3d T_map_body = Eigen::Isometry3d::Identity();  ///< Translation in metres.
};

/// Trajectory of a body: its poses over time.
class PoseTrack {
 public:
  /// @param poses  At least one, in any order, each stamp once; rotations may be rounded to six digits.
  /// @throws std::invalid_argument  naming the wrong pose and the cure: no poses, two of one stamp, a number
  ///         that is not finite, a matrix that is no rotation.
  explicit PoseTrack(std::vector<StampedPose> poses);

  /// Pose at a time, interpolated as by tf: linear translation, rotation along the shorter way at a constant
  /// rate. Before the first and after the last pose: that pose. Rounded to nine decimals, as the node rounds
  /// poses from tf.
  [[nodiscard]] Eigen::Isometry3d at(std::int64_t stamp_ns) const;

  /// Stamps of the first and the last pose.
  ///@{
  [[nodiscard]] std::int64_t begin_ns() const { return poses_.front().stamp_ns; }
  [[nodiscard]] std::int64_t end_ns() const { return poses_.back().stamp_ns; }
  ///@}
  /// Whether a stamp lies between the first and the last, or equals one of them.
  [[nodiscard]] bool covers(std::int64_t stamp_ns) const {
    return begin_ns() <= stamp_ns && stamp_ns <= end_ns();
  }
  /// Number of poses.
  [[nodiscard]] std::size_t size() const { return poses_.size(); }

 private:
  [[nodiscard]] Eigen::Isometry3d interpolate(std::int64_t stamp_ns) const;

  std::vector<StampedPose> poses_;  ///< Ordered by stamp.
};

}  // namespace cuboid_mapping
