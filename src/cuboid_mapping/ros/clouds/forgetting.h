// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/voxel_motion.h"
#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/ros/middleware/stamp_clock.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <ros/time.h>

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace cuboid_mapping_ros {

/// Forgets voxels that no cloud has seen for some time, by the stamps of the clouds. Replays of a recording
/// give the same result.
///
/// Each source remembers its voxels for its own time (forget_after), or for ever (0). A seen voxel that no
/// source remembers is forgotten. Forgetting may be limited to one class of voxels; the others then stay as
/// they are.
///
/// Time is kept per brick of 8 x 8 x 8 voxels: a brick is seen as long as a beam passes or hits any of its
/// voxels. Locked voxels stay, and so do bricks that no cloud has seen, such as those of a file or a service.
/// Stamps that lead the others, and sources with clocks of their own, see StampClock. Not thread-safe.
class Forgetting {
 public:
  /// @param parameters  With those of the sources. If no source forgets, note() does nothing.
  explicit Forgetting(const NodeParameters& parameters);

  /// Whether any source forgets.
  [[nodiscard]] bool isOn() const { return shortest_ns_ > 0; }

  /// Notes the voxels of a cloud, and finds bricks that are due, at most ten times in the shortest time. A
  /// stamp of 0 is ignored.
  /// @complexity O(bricks of the update); when it looks for due bricks, O(bricks remembered).
  void note(const ScanUpdate& update, const ros::Time& stamp, std::size_t source = 0);

  /// Whether a brick is due.
  [[nodiscard]] bool hasDue() const { return !due_.empty(); }
  /// Forgets some of the due bricks, so that others can use the map in between.
  /// @return Changes of the map. @complexity O(1).
  ChangeSet forgetSome(CuboidMap& map);

  /// The same in another frame: a brick is remembered for as long as any brick that moves into it.
  /// @complexity O(bricks remembered).
  [[nodiscard]] Forgetting moved(const VoxelMotion& motion) const;

 private:
  /// Time of the clock in nanoseconds.
  using Time = std::int64_t;

  void remember(const std::vector<Cell>& bricks, std::size_t source, Time time);
  void findDue();

  Forget forget_;
  std::vector<Time> times_ns_;  ///< Values of forget_after for each source; 0: for ever.
  Time shortest_ns_ = 0;
  StampClock clock_;
  Time last_sweep_ = 0;
  /// Bricks of the last cloud of each source, if its stamp is not believed.
  std::vector<std::vector<Cell>> doubted_;
  /// Last time at which a brick is remembered, by its least cell.
  std::unordered_map<Cell, Time, CellHash> remembered_;
  std::vector<Cell> due_;  ///< Bricks to forget, unless they were seen since.
};

}  // namespace cuboid_mapping_ros
