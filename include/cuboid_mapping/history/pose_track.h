// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/isometry.h"

#include <cstdint>
#include <limits>
#include <optional>
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
  /// @param max_gap_s  Poses farther apart have a gap between them, see findGap(): >= 0.
  /// @throws std::invalid_argument  naming the wrong pose and the cure: no poses, two of one stamp, a number
  ///         that is not finite, a matrix that is no rotation; or a bad max_gap_s.
  explicit PoseTrack(std::vector<StampedPose> poses,
                     double max_gap_s = std::numeric_limits<double>::infinity());

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
  /// A time without poses, between two of them.
  struct Gap {
    std::int64_t begin_ns = 0;  ///< Time of the last pose before it.
    std::int64_t end_ns = 0;    ///< Time of the first pose after it.
  };
  /// The gap that a stamp lies in, for which at() is a guess; nothing at a pose, and outside the poses.
  [[nodiscard]] std::optional<Gap> findGap(std::int64_t stamp_ns) const;
  /// All gaps, in order.
  [[nodiscard]] std::vector<Gap> gaps() const;
  /// Number of poses.
  [[nodiscard]] std::size_t size() const { return poses_.size(); }

 private:
  [[nodiscard]] Eigen::Isometry3d interpolate(std::int64_t stamp_ns) const;

  [[nodiscard]] bool isGap(const StampedPose& first, const StampedPose& next) const {
    return 1e-9 * static_cast<double>(next.stamp_ns - first.stamp_ns) > max_gap_s_;
  }

  std::vector<StampedPose> poses_;  ///< Ordered by stamp.
  double max_gap_s_;
};

}  // namespace cuboid_mapping
