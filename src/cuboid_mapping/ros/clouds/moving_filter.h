// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/ros/parameters/parameters.h"
#include "cuboid_mapping/scan/scan.h"
#include "cuboid_mapping/scan/void_space.h"

#include <Eigen/Core>

#include <atomic>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {

/// Finds points of moving objects from earlier clouds. Replays of a recording give the same result.
///
/// With a window it forgets bricks outside the window and its margin that no cloud has touched for a while.
/// This depends on the clouds alone, not on the disk or on calls for parts of the map. A part that is loaded
/// again has to be seen empty again.
///
/// Memory: about 100 bytes for each brick of 8 x 8 x 8 voxels that has void ones. Not thread-safe except for
/// reset().
class MovingFilter {
 public:
  /// @param what  With kIgnore, nothing is noted and no point moves. @param window  Window of the map.
  MovingFilter(double resolution_m, MovingPoints what, const WindowParameters& window = {})
      : grid_(resolution_m), what_(what), window_(window) {}

  /// Points in void voxels, map frame, in metres. Call it before take().
  [[nodiscard]] std::vector<Eigen::Vector3d> findMoving(const std::vector<Scan>& scans) const;

  /// Notes a cloud. @return The part that goes into the map: all, or with kLeaveOut all but hits in voxels that
  /// were void
  ///         before. Valid until the next call, and as long as `update`.
  /// @param window_center_map  Ignored without a window.
  [[nodiscard]] const ScanUpdate& take(
      const ScanUpdate& update, const Eigen::Vector3d& window_center_map = Eigen::Vector3d::Zero());

  /// Void space of all clouds so far.
  [[nodiscard]] const VoidSpace& voidSpace() const { return void_space_; }

  /// Replaces the void space, for example by that of another frame.
  void setVoidSpace(VoidSpace void_space) { void_space_ = std::move(void_space); }

  /// Forgets everything before the next cloud. Thread-safe.
  void reset() { is_reset_ = true; }

 private:
  Grid grid_;
  MovingPoints what_;
  WindowParameters window_;
  VoidSpace void_space_;
  ScanUpdate rest_;
  std::atomic<bool> is_reset_{false};
};

/// Frees occupied voxels in void space after a drive, except locked ones: objects that passed before the place
/// was known to be empty. These voxels get the log-odds of one miss.
/// @return Number of voxels.
std::size_t freeVoidVoxels(const VoidSpace& void_space, CuboidMap& map);

}  // namespace cuboid_mapping_ros
