// SPDX-License-Identifier: BSD-3-Clause
// Example:
//     PosePathTask task;
//     task.body.boxes.push_back({Eigen::Isometry3d::Identity(), {0.6, 0.4, 0.3}});
//     task.start_map = Eigen::Translation3d(0.5, 0.5, 0.5);
//     task.goal_map = Eigen::Translation3d(3.5, 0.5, 0.5);
//     const auto path = findPosePath(map, task, UnknownPolicy::kObstacle, Budget::unlimited());
//     if (path.isFound()) std::cout << path->T_map_body.size() << " poses\n";
#pragma once

#include "cuboid_mapping/query/corridor_query.h"
#include "cuboid_mapping/query/motion_query.h"

namespace cuboid_mapping {

/// Request of findPosePath().
struct PosePathTask {
  Body body;  ///< The robot; it turns about its origin.
  Eigen::Isometry3d start_map = Eigen::Isometry3d::Identity();  ///< Pose of the body, upright.
  Eigen::Isometry3d goal_map = Eigen::Isometry3d::Identity();   ///< Pose of the body, upright.
  bool may_climb = false;  ///< Whether it may move along z; else it stays at the start's height.
  /// Room along its x and y (around its balls: on all sides) that the body keeps where there is any, >= 0: less of it costs more, up to three times the
  /// length.
  double clearance_m = 0.0;
  /// Longest way out of the obstacles that the body touches at the start, >= 0; 0: kNotFound with Blocked::kStart.
  /// A turn counts as the path of the point that moves most.
  double start_tolerance_m = 0.0;
  /// Largest distance from the goal at which the path may end if the body cannot reach it, >= 0; infinity: as near as
  /// it gets. The heading may then differ.
  double goal_tolerance_m = 0.0;
  /// Voxels that the body may not leave; nothing: the bounds of map, start and goal, with room to go around
  /// them. With UnknownPolicy::kFree, it leaves the heights of start and goal by at most twice its reach.
  std::optional<CellBox> region;
};

/// Reason why findPosePath() cannot answer, and the cure; empty if it can.
[[nodiscard]] std::string findFault(const PosePathTask& task, const Grid& grid);

/// Path of findPosePath().
struct PosePath {
  /// Poses from start to goal. checkMotion() finds each motion between two of them free, but for the first one if
  /// start_distance_m > 0.
  std::vector<Eigen::Isometry3d> T_map_body;
  double length_m = 0.0;  ///< Length of the path of the body's origin.
  /// Length of the first motion, if the start touches obstacles: the way out of them, its turn counted as in
  /// PosePathTask::start_tolerance_m. Else 0.
  double start_distance_m = 0.0;
  double goal_distance_m = 0.0;  ///< Distance of the end of the path from the goal.
  /// A voxel that the body touches where it is blocked. With kFound: at the start, if that is blocked, else at the goal,
  /// if that is. Nothing: it touches none there, or only leaves the region.
  std::optional<Cell> met;
  std::size_t num_poses = 0;  ///< Number of poses at which the last search has checked the map.
  Blocked blocked = Blocked::kBetween;  ///< Where, with kNotFound.
};

/// Finds a way for a body that moves in any direction, and turns about z.
///
/// A* (P. Hart, N. Nilsson, B. Raphael, 1968) on the lattice of voxel centres in the plane of the start (and
/// planes whole voxels above and below, if it may climb) and 16 headings, 22.5 degrees apart, from 0 on. A step
/// goes to one of 8 neighbours in the plane, to the next heading, or up or down. Start and goal are joined to
/// the places and headings around them, and to each other. checkMotion() checks a motion when the search is
/// about to use it, and only where a box that encloses all headings does not fit. Finally, steps are joined if
/// the straight motion is free.
///
/// The search is complete on this lattice only: it may miss ways through gaps less than a voxel wider than the
/// body, and ways that need other headings. The path need not be the shortest.
///
/// Tolerances are those of findCorridor(). The way out is one motion to a pose of the lattice, short rather than
/// the shortest: its length counts ten times. It may enter occupied voxels by 0.1 voxels more.
///
/// If others change the map during the search (MapUnlock), the path is checked again; if it is blocked,
/// the search starts again.
///
/// Cases:
///   - a fault, see findFault(): kInvalid;
///   - kNotFound: only PosePath::blocked, met and num_poses are set;
///   - the budget is spent during the search: kBudgetSpent; while steps are joined: kFound, with more poses.
///
/// @param budget  Entries are poses of the path: with more of them than entries, kBudgetSpent, unless the time ends
///                while steps are joined.
/// @complexity O(k log k) for k places and headings that A* reaches. A step costs a look-up where all headings
/// fit, and checkMotion() elsewhere.
Answer<PosePath> findPosePath(const CuboidMap& map, const PosePathTask& task, UnknownPolicy policy,
                              Budget& budget);

}  // namespace cuboid_mapping
