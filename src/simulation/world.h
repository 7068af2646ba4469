// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "simulation/closed_path.h"
#include "simulation/shape.h"

#include <Eigen/Geometry>

#include <cstdint>
#include <vector>

namespace cuboid_mapping {

/// Kind of a solid.
enum class SolidKind {
  kGround,
  kWall,
  kCeiling,
  kStairs,
  kPillar,
  kFurniture,
  kFence,
  kTree,
  kCar,
  kCrate,
  kDoor,    ///< The door; see DoorMotion.
  kWalker,  ///< The person.
};

/// Motion of the door.
enum class DoorMotion {
  kMoves,   ///< It opens and closes.
  kOpen,    ///< It stays open.
  kClosed,  ///< It stays closed.
};

/// A part of the simulated world; solids may touch and overlap.
struct Solid {
  SolidKind kind;
  Shape shape;
};

/// A one-storey building of five rooms and a corridor, and a fenced yard without a roof.
///
/// Seen from above, x to the right from 0 to 34 m, y upwards from -3 to 15 m; the yard is the right
/// half, and +++ is the way of the robot:
///
///     +-----------+----------+ ............
///     | hall     ++++ stairs +++++   car  :
///     |  +       ||          |    +++     :
///     +--+-------++----------+   o   ++   :
///     |  + corridor ++++++++++++  tree +  :
///     +--+---+-- +-+-door----+ ++      +  :
///     | A+++++++++ | C       |   ++++++   :
///     |      | B   |         |            :
///     +------+-----+---------+ ............
///
/// The places of the furniture, the car and the crates, and the walker's place at time 0 vary with
/// the seed. The ground is at z = 0.03 m and all walls are 0.03 m off the multiples of 0.1 m, so
/// that faces lie inside the voxels of the usual resolutions instead of on their borders.
/// Times are in seconds from the start of the simulation, any number >= 0. Thread-safe: const.
class World {
 public:
  /// The robot is a cylinder around the origin of its base.
  static constexpr double kRobotRadius_m = 0.35;
  static constexpr double kRobotHeight_m = 1.2;
  static constexpr double kRobotSpeed = 1.0;  ///< Metres per second.

  explicit World(std::uint64_t seed, DoorMotion door = DoorMotion::kMoves);

  /// Everything that does not move.
  [[nodiscard]] const std::vector<Solid>& fixedSolids() const { return fixed_; }

  /// All solids at a time: the fixed ones, then the door, then the walker.
  [[nodiscard]] std::vector<Solid> computeSolids(double time_s) const;

  /// The path of the robot, map frame; it meets neither a fixed solid nor the door nor the walker.
  [[nodiscard]] const ClosedPath& robotPath() const { return robot_path_; }

  /// Duration of one lap of the robot.
  [[nodiscard]] double lapDuration() const { return robot_path_.length() / kRobotSpeed; }

  /// The pose of the robot's base (on the ground, x forward) on its path: T_map_base.
  [[nodiscard]] Eigen::Isometry3d computeRobotPose(double time_s) const;

 private:
  std::vector<Solid> fixed_;
  ClosedPath robot_path_;
  ClosedPath walker_path_;
  double walker_start_m_;
  DoorMotion door_;
};

/// Share of the light that a kind of solid reflects, from 0 to 1.
[[nodiscard]] float computeReflectivity(SolidKind kind);

}  // namespace cuboid_mapping
