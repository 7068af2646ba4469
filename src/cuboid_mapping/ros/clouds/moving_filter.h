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

/// Finds points of moving things by earlier clouds: the same for a recording whenever it is played.
///
/// With a window it forgets what lies outside, with its margin, and no cloud has touched for a while, as the map in memory does,
/// but by the clouds alone: neither the disk nor those who ask for parts of the map make a difference. A place that comes
/// back has to be seen empty again.
///
/// Memory: some 100 bytes for each brick of 8 x 8 x 8 voxels with void ones. Not thread-safe but for reset().
class MovingFilter {
 public:
  /// @param what  With kIgnore, nothing is noted and no point moves. @param window  Of the map.
  MovingFilter(double resolution_m, MovingPoints what, const WindowParameters& window = {})
      : grid_(resolution_m), what_(what), window_(window) {}

  /// The points that are in void voxels, map frame, in metres. To be called before take().
  [[nodiscard]] std::vector<Eigen::Vector3d> findMoving(
      const std::vector<cuboid_mapping::Scan>& scans) const;

  /// Notes a cloud. @return What of it goes into the map: all, or with kLeaveOut all but the hits in what was void
  ///         before. Valid until the next call, and as long as `update`.
  /// @param window_center_map  Not looked at without a window.
  [[nodiscard]] const cuboid_mapping::ScanUpdate& take(
      const cuboid_mapping::ScanUpdate& update,
      const Eigen::Vector3d& window_center_map = Eigen::Vector3d::Zero());

  /// Counts all clouds so far.
  [[nodiscard]] const cuboid_mapping::VoidSpace& voidSpace() const { return void_space_; }

  /// Puts what is void in another frame in the place of what is void so far.
  void setVoidSpace(cuboid_mapping::VoidSpace void_space) { void_space_ = std::move(void_space); }

  /// Forgets everything before the next cloud. Thread-safe.
  void reset() { is_reset_ = true; }

 private:
  cuboid_mapping::Grid grid_;
  MovingPoints what_;
  WindowParameters window_;
  cuboid_mapping::VoidSpace void_space_;
  cuboid_mapping::ScanUpdate rest_;
  std::atomic<bool> is_reset_{false};
};

/// Frees what is occupied in void voxels, but for locked ones, after a drive: what has passed there before it was known
/// that the place is empty. Such a voxel is then as if a beam had passed it once.
/// @return Number of voxels.
std::size_t freeVoidVoxels(const cuboid_mapping::VoidSpace& void_space,
                           cuboid_mapping::CuboidMap& map);

}  // namespace cuboid_mapping_ros
