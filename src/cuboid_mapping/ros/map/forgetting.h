// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/voxel_motion.h"
#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <ros/time.h>

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace cuboid_mapping_ros {

/// Forgets voxels that no cloud has seen for some time, by the stamps of the clouds: the same for a
/// recording whenever it is played.
///
/// Each source remembers for a time of its own (forget_after) what it sees, or for ever (0). What none remembers that has
/// seen it is forgotten. One class of voxels may be all that is forgotten; the others then stay as they are.
///
/// Time is kept for bricks of 8 x 8 x 8 voxels: a brick is seen as long as a beam passes or hits any of its
/// voxels. Locked voxels stay. So does what no cloud has ever seen, as from a file or a service. When stamps jump
/// back by more than the shortest time, all is remembered for as long as it was to be. Not thread-safe.
class Forgetting {
 public:
  /// @param parameters  With those of the sources. Where none forgets, note() does nothing.
  explicit Forgetting(const NodeParameters& parameters);

  /// Whether any source forgets.
  [[nodiscard]] bool isOn() const { return shortest_ns_ > 0; }

  /// Notes what a cloud of a source has seen, and finds what is due, at most ten times in the shortest time. A stamp of
  /// 0 says nothing.
  /// @complexity O(bricks of the update); where it is time, O(bricks remembered).
  void note(const cuboid_mapping::ScanUpdate& update, const ros::Time& stamp,
            std::size_t source = 0);

  /// Whether something is to be forgotten.
  [[nodiscard]] bool hasDue() const { return !due_.empty(); }
  /// Forgets some of what is due, so that others can have the map in between.
  /// @return What has changed in the map. @complexity O(1).
  cuboid_mapping::ChangeSet forgetSome(cuboid_mapping::CuboidMap& map);

  /// The same in another frame: a brick is remembered as long as any of those that come to lie in it.
  /// @complexity O(bricks remembered).
  [[nodiscard]] Forgetting moved(const cuboid_mapping::VoxelMotion& motion) const;

 private:
  /// Nanoseconds, as of stamps.
  using Time = std::uint64_t;

  void jumpBack(Time to);
  void findDue();

  ForgetClass class_;
  ForgetTo forget_to_;
  std::vector<Time> times_ns_;  ///< forget_after of each source; 0: for ever.
  Time shortest_ns_ = 0;
  Time now_ = 0;  ///< Stamp of the last cloud.
  Time last_sweep_ = 0;
  /// Last time at which a brick is remembered, by its least cell.
  std::unordered_map<cuboid_mapping::Cell, Time, cuboid_mapping::CellHash> remembered_;
  std::vector<cuboid_mapping::Cell> due_;  ///< To be forgotten, if nothing has seen them since.
};

}  // namespace cuboid_mapping_ros
