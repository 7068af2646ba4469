// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <optional>

namespace cuboid_mapping_ros {

/// Notices that poses jump to and fro between two places: two runs, two robots or two publishers share one name.
class ToAndFro {
 public:
  /// @param position  Of the next pose, in order of time.
  void add(const Eigen::Vector3d& position) {
    if (last_ && before_ && isFar(*before_, *last_, kLeastJump_m)) {
      ++num_jumps_;
      const double jump_m = (*last_ - *before_).norm();
      num_returns_ += isFar(*before_, position, kNear * jump_m) ? 0 : 1;
    }
    before_ = last_;
    last_ = position;
  }

  /// Whether many jumps lead back to the place before them. A robot that drives fast, or whose pose is corrected,
  /// does not return.
  [[nodiscard]] bool isSeen() const {
    return num_returns_ >= kLeastReturns && 5 * num_returns_ >= 2 * num_jumps_;
  }

 private:
  static constexpr double kLeastJump_m = 0.3;
  static constexpr double kNear = 0.2;  ///< Part of a jump.
  static constexpr std::size_t kLeastReturns = 10;

  static bool isFar(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double distance_m) {
    return (a - b).norm() > distance_m;
  }

  std::optional<Eigen::Vector3d> before_;
  std::optional<Eigen::Vector3d> last_;
  std::size_t num_jumps_ = 0;
  std::size_t num_returns_ = 0;
};

}  // namespace cuboid_mapping_ros
