// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/query/corridor_query.h"
#include "cuboid_mapping/query/motion_query.h"

namespace cuboid_mapping {

/// Request of findPosePath().
struct PosePathTask {
  Body body;  ///< The robot; it turns about its origin.
  Eigen::Isometry3d start_map = Eigen::Isometry3d::Identity();  ///< Pose of the body, upright.
  Eigen::Isometry3d goal_map = Eigen::Isometry3d::Identity();   ///< Pose of the body, upright.
  UnknownPolicy policy = UnknownPolicy::kStop;  ///< Whether unknown space is in the way.
  bool may_climb = false;  ///< Whether it may move along z; else it stays at the start's height.
  /// Voxels that the body may not leave; nothing: the map's bounds, start and goal, and room to go around them.
  std::optional<CellBox> region;
};

/// Reason why findPosePath() cannot answer, and the cure; empty if it can.
[[nodiscard]] std::string findFault(const PosePathTask& task, const Grid& grid);

/// Answer of findPosePath().
struct PosePath {
  CorridorEnd end = CorridorEnd::kInvalid;  ///< Path and length are there for kFound only.
  /// Poses from start to goal. checkMotion() has found each motion between two of them free.
  std::vector<Eigen::Isometry3d> T_map_body;
  double length_m = 0.0;      ///< Length of the path of the body's origin.
  std::size_t num_poses = 0;  ///< Number of poses that the search has looked up in the map.
};

/// Finds a way for a body that moves in any direction, and turns about z.
///
/// A* (P. Hart, N. Nilsson, B. Raphael, 1968) on the lattice of voxel centres in the plane of the start (and planes
/// whole voxels above and below, if it may climb) and 16 headings, 22.5 degrees apart, from 0 on. A step goes to
/// one of 8 neighbours in the plane, to the next heading, or up or down. Start and goal are joined to the places and
/// headings around them, and to each other. Motions are checked as by checkMotion(), late, and only where
/// a box that encloses all headings does not fit. Finally, steps are joined if the straight motion is free.
///
/// Complete on this lattice only: it may miss ways that need finer places, as gaps that are less than a voxel
/// wider than the body, or finer headings. The path need not be the shortest.
///
/// If others change the map during the search (MapTurns), the path is checked again, and searched again if it is blocked.
///
/// @param budget  Spent during the search: kBudgetSpent. Spent while steps are joined: kFound, with more poses. Its
///                entries are poses of the path; more than those: kBudgetSpent.
/// @complexity O(k log k) for k places and headings that A* reaches; in a free place that holds all headings a step
/// costs a look-up, elsewhere a motion.
[[nodiscard]] PosePath findPosePath(const CuboidMap& map, const PosePathTask& task,
                                    Budget& budget = Budget::unlimited());

}  // namespace cuboid_mapping
