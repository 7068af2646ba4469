// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/budget.h"
#include "cuboid_mapping/query/unknown_policy.h"

#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping {

/// Request of findCorridor().
struct CorridorTask {
  Eigen::Vector3d start_map = Eigen::Vector3d::Zero();  ///< Centre of the robot's box.
  Eigen::Vector3d goal_map = Eigen::Vector3d::Zero();   ///< Centre of the robot's box.
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();     ///< Robot: a box that does not turn, > 0.
  UnknownPolicy policy = UnknownPolicy::kStop;          ///< Whether unknown space is in the way.
  /// Voxels that the robot may not leave; nothing: the bounds of map, start and goal, with room to go around
  /// them.
  std::optional<CellBox> region;
};

/// End of a search for a corridor.
enum class CorridorEnd : unsigned char {
  kInvalid,       ///< A number is not finite, the size not > 0, or out of the grid's range.
  kFound,         ///< There is a corridor.
  kStartBlocked,  ///< The robot at the start meets an obstacle, or leaves the region.
  kGoalBlocked,   ///< As kStartBlocked, at the goal.
  kNoWay,         ///< There is none: the search has seen all places reachable from the start.
  kBudgetSpent,   ///< The budget was spent before a corridor was found.
};

/// Answer of findCorridor().
struct Corridor {
  /// Only kFound has boxes, portals, path and length.
  CorridorEnd end = CorridorEnd::kInvalid;
  /// Maximal boxes without obstacle, from start to goal; the robot fits into the overlap of two successive
  /// boxes.
  std::vector<CellBox> boxes;
  /// Centres of the overlaps of successive boxes: one less than boxes.
  std::vector<Eigen::Vector3d> portals_map;
  /// Path of the robot's centre from start to goal: each segment, robot included, lies in one box.
  std::vector<Eigen::Vector3d> path_map;
  double length_m = 0.0;        ///< Length of the path.
  std::size_t num_visited = 0;  ///< Boxes of places that the search has made.
};

/// Finds a corridor of overlapping boxes through which a robot, a box that does not turn, gets from
/// a start to a goal.
///
/// The places of the robot are the map eroded by its box, rounded up to voxels. A* (P. Hart, N. Nilsson, B.
/// Raphael, 1968) searches them as boxes, into which each brick is divided when it is reached. The boxes along
/// the way then grow in the map until they are maximal, and the path is shortened in them.
///
/// A corridor is found if and only if the robot can go from voxel to voxel: places of its box on the grid, each
/// a voxel beside the one before. It need not be the shortest.
///
/// @param budget  Spent during the search: kBudgetSpent. Spent later, while boxes grow: kFound, with boxes that
///                are not maximal.
/// @complexity O(b + k log k) for b bricks and k boxes of places that A* reaches.
[[nodiscard]] Corridor findCorridor(const CuboidMap& map, const CorridorTask& task,
                                    Budget& budget = Budget::unlimited());

}  // namespace cuboid_mapping
