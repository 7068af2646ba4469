// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/history/pose_track.h"

#include "cuboid_mapping/geometry/rounded_transform.h"

#include <algorithm>
#include <iomanip>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

namespace cuboid_mapping {
namespace {

/// Tolerance for rotations in files of poses, which have few digits.
constexpr double kRotationTolerance = 1e-3;
/// Deviation of a pose's matrix from a rotation.
double findStretch(const StampedPose& pose) {
  const Eigen::Matrix3d matrix = pose.T_map_body.linear();
  return (matrix * matrix.transpose() - Eigen::Matrix3d::Identity()).norm();
}

[[noreturn]] void refuse(const StampedPose& pose, const std::string& what) {
  std::ostringstream text;
  text << "the pose at " << std::fixed << std::setprecision(6)
       << 1e-9 * static_cast<double>(pose.stamp_ns) << " s " << what;
  throw std::invalid_argument(text.str());
}

void check(const StampedPose& pose) {
  const auto& matrix = pose.T_map_body.matrix();
  if (!matrix.allFinite()) refuse(pose, "has a number that is not finite: leave it out");
  const bool is_rotation =
      findStretch(pose) <= kRotationTolerance && pose.T_map_body.linear().determinant() > 0.0;
  if (!is_rotation) refuse(pose, "has no rotation: its quaternion must have the length 1");
}

bool isEarlier(const StampedPose& a, const StampedPose& b) { return a.stamp_ns < b.stamp_ns; }

}  // namespace

PoseTrack::PoseTrack(std::vector<StampedPose> poses, double max_gap_s)
    : poses_(std::move(poses)), max_gap_s_(max_gap_s) {
  if (poses_.empty()) throw std::invalid_argument("there are no poses: give one at least");
  if (!(max_gap_s >= 0.0)) throw std::invalid_argument("max_gap must be a number >= 0, in seconds");
  for (StampedPose& pose : poses_) {
    check(pose);
    pose.T_map_body.linear() =
        Eigen::Quaterniond(pose.T_map_body.linear()).normalized().toRotationMatrix();
  }
  std::stable_sort(poses_.begin(), poses_.end(), isEarlier);
  const auto twin = std::adjacent_find(
      poses_.begin(), poses_.end(),
      [](const StampedPose& a, const StampedPose& b) { return a.stamp_ns == b.stamp_ns; });
  if (twin != poses_.end()) refuse(*twin, "is there twice: give one pose for each stamp");
}

std::optional<PoseTrack::Gap> PoseTrack::findGap(std::int64_t stamp_ns) const {
  const auto after =
      std::lower_bound(poses_.begin(), poses_.end(), StampedPose{stamp_ns, {}}, isEarlier);
  if (after == poses_.begin() || after == poses_.end() || after->stamp_ns == stamp_ns) return {};
  const StampedPose& first = *std::prev(after);
  return isGap(first, *after) ? std::make_optional(Gap{first.stamp_ns, after->stamp_ns})
                              : std::nullopt;
}

std::vector<PoseTrack::Gap> PoseTrack::gaps() const {
  std::vector<Gap> gaps;
  for (std::size_t i = 0; i + 1 < poses_.size(); ++i) {
    if (isGap(poses_[i], poses_[i + 1]))
      gaps.push_back({poses_[i].stamp_ns, poses_[i + 1].stamp_ns});
  }
  return gaps;
}

Eigen::Isometry3d PoseTrack::at(std::int64_t stamp_ns) const {
  return roundTransform(interpolate(stamp_ns));
}

Eigen::Isometry3d PoseTrack::interpolate(std::int64_t stamp_ns) const {
  const auto after =
      std::upper_bound(poses_.begin(), poses_.end(), StampedPose{stamp_ns, {}}, isEarlier);
  if (after == poses_.begin()) return poses_.front().T_map_body;
  const StampedPose& first = *std::prev(after);
  if (after == poses_.end() || first.stamp_ns == stamp_ns) return first.T_map_body;
  const double ratio = static_cast<double>(stamp_ns - first.stamp_ns) /
                       static_cast<double>(after->stamp_ns - first.stamp_ns);
  const Eigen::Isometry3d& a = first.T_map_body;
  const Eigen::Isometry3d& b = after->T_map_body;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = a.translation() + ratio * (b.translation() - a.translation());
  pose.linear() = Eigen::Quaterniond(a.linear())
                      .slerp(ratio, Eigen::Quaterniond(b.linear()))
                      .normalized()
                      .toRotationMatrix();
  return pose;
}

}  // namespace cuboid_mapping
