// SPDX-License-Identifier: BSD-3-Clause
// Example:
//     CorridorTask task;
//     task.start_map = {0.5, 0.5, 0.5};
//     task.goal_map = {3.5, 0.5, 0.5};
//     task.size_m = {0.5, 0.5, 0.5};
//     task.clearance_m = 0.3;
//     const auto way = findCorridor(map, task, UnknownPolicy::kObstacle, Budget::unlimited());
//     if (way.isFound()) std::cout << way->boxes.size() << " boxes, " << way->length_m << " m\n";
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/answer.h"
#include "cuboid_mapping/query/budget.h"
#include "cuboid_mapping/query/unknown_policy.h"

#include <optional>
#include <vector>

namespace cuboid_mapping {

/// Request of findCorridor().
struct CorridorTask {
  Eigen::Vector3d start_map = Eigen::Vector3d::Zero();  ///< Centre of the robot's box.
  Eigen::Vector3d goal_map = Eigen::Vector3d::Zero();   ///< Centre of the robot's box.
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();     ///< Robot: a box that does not turn, > 0.
  double inflation_m = 0.0;                             ///< Added on all sides of the robot, >= 0.
  /// Distance along x and y that the path keeps from the faces of the boxes, >= 0: where there is less room, it
  /// goes through the middle.
  double clearance_m = 0.0;
  /// Longest way out of the obstacles that the robot touches at the start, >= 0; 0: kNotFound with Blocked::kStart.
  double start_tolerance_m = 0.0;
  /// Largest distance from the goal at which the path may end if the robot cannot reach it, >= 0; infinity: as near as
  /// it gets.
  double goal_tolerance_m = 0.0;
  /// Voxels that the robot may not leave; nothing: the bounds of map, start and goal, with room to go around
  /// them. With UnknownPolicy::kFree, it stays between the heights of start and goal.
  std::optional<CellBox> region;
};

/// Where a robot does not get through.
enum class Blocked : unsigned char {
  kStart,    ///< The robot at the start meets an obstacle, or leaves the region.
  kGoal,     ///< As kStart, at the goal.
  kBetween,  ///< The search has seen all places reachable from the start.
};

/// Corridor of findCorridor().
struct Corridor {
  /// Maximal boxes without obstacle, from start to goal; the robot fits into the overlap of two successive
  /// boxes.
  std::vector<CellBox> boxes;
  /// Centres of the overlaps of successive boxes: one less than boxes.
  std::vector<Eigen::Vector3d> portals_map;
  /// Path of the robot's centre from start to goal: each segment, robot included, lies in one box. With
  /// start_distance_m > 0, the first segment comes before the boxes.
  std::vector<Eigen::Vector3d> path_map;
  double length_m = 0.0;  ///< Length of the path.
  /// Length of the first segment of the path, if the start touches obstacles: the way out of them. Else 0.
  double start_distance_m = 0.0;
  double goal_distance_m = 0.0;  ///< Distance of the end of the path from the goal.
  /// A voxel that the robot touches where it is blocked. With kFound: at the start, if that is blocked, else at the goal,
  /// if that is. An occupied one if there is any. Nothing: it touches none there, or only leaves the region.
  std::optional<Cell> met;
  std::size_t num_visited = 0;          ///< Boxes of places that the search has made.
  Blocked blocked = Blocked::kBetween;  ///< Where, with kNotFound.
};

/// Finds a corridor of overlapping boxes through which a robot, a box that does not turn, gets from
/// a start to a goal.
///
/// The places of the robot are the map eroded by its box, rounded up to voxels. A* (P. Hart, N. Nilsson, B.
/// Raphael, 1968) searches them as boxes, into which each brick is divided when it is reached. Straight lines take the
/// place of parts of the way where the robot fits along them. The boxes along the way then grow in the map until they
/// are maximal, and the path is shortened in them.
///
/// A corridor is found if and only if the robot can go from voxel to voxel: places of its box on the grid, each
/// a voxel beside the one before. It need not be the shortest. Clearance moves the path inside the boxes, and
/// changes neither the boxes nor whether there are any.
///
/// Tolerances: a robot that touches obstacles at the start leaves them on the shortest straight way to a place from
/// which the goal can be reached. On it, no occupied voxel is entered more deeply than at the start (measured by how far
/// the robot would have to shrink), and unknown space is free. If the goal is blocked, or cannot be reached, the path
/// ends at the reachable position that is nearest to it.
///
/// If others change the map during the search (MapUnlock), the boxes are looked up again; if one has an
/// obstacle, the search starts again.
///
/// Cases:
///   - a number that is not finite (tolerances may be infinite), a size that is not > 0, an inflation, clearance or
///     tolerance < 0, an end out of the grid's range: kInvalid;
///   - kNotFound: only Corridor::blocked, met and num_visited are set;
///   - the budget is spent during the search: kBudgetSpent; later, while boxes grow: kFound, with boxes that
///     are not maximal.
///
/// @complexity O(b + k log k) for b bricks and k boxes of places that A* reaches.
Answer<Corridor> findCorridor(const CuboidMap& map, const CorridorTask& task, UnknownPolicy policy,
                              Budget& budget);

}  // namespace cuboid_mapping
