// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/ros/parameters.h"

#include <ros/time.h>

#include <unordered_map>

namespace cuboid_mapping_ros {

/// Makes voxels unknown that no cloud has seen for some time, by the stamps of the clouds: the same for a
/// recording whenever it is played.
///
/// One class of voxels may be all that is forgotten; the others of a brick then stay as they are.
///
/// Time is kept for bricks of 8 x 8 x 8 voxels: a brick is seen as long as a beam passes or hits any of its
/// voxels. Locked voxels stay. So does what no cloud has ever seen, as from a file or a service. When stamps jump
/// back by more than the time, all counts as seen at the new one. Not thread-safe.
class Forgetting {
 public:
  /// @param after_s  >= 0; 0: nothing is ever forgotten, and note() and forget() do nothing.
  explicit Forgetting(double after_s, ForgetClass forgotten = ForgetClass::kAll)
      : after_(after_s), class_(forgotten) {}

  /// Notes what a cloud has seen. A stamp of 0 says nothing. @complexity O(bricks of the update).
  void note(const cuboid_mapping::ScanUpdate& update, const ros::Time& stamp);

  /// Forgets what is due, at most ten times while `after_s` passes. To be called after each note().
  /// @return What has changed in the map.
  /// @complexity O(bricks seen so far) where it is time; else O(1).
  cuboid_mapping::ChangeSet forget(cuboid_mapping::CuboidMap& map);

 private:
  using Seen = std::unordered_map<cuboid_mapping::Cell, ros::Time, cuboid_mapping::CellHash>;

  ros::Duration after_;
  ForgetClass class_;
  ros::Time now_;  ///< Stamp of the last cloud.
  ros::Time last_sweep_;
  Seen seen_;  ///< By the least cell of the brick.
};

}  // namespace cuboid_mapping_ros
