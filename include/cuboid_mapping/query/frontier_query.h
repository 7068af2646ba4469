// SPDX-License-Identifier: BSD-3-Clause
// Example:
//     FrontierTask task;
//     task.size_m = {0.4, 0.4, 0.4};
//     const auto frontiers = findFrontiers(map, task, Budget::unlimited());
//     for (const Frontier& frontier : frontiers.value) {
//       std::cout << frontier.voxels.size() << " voxels\n";
//     }
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/query/answer.h"
#include "cuboid_mapping/query/budget.h"

#include <cstddef>
#include <optional>
#include <vector>

namespace cuboid_mapping {

/// Request of findFrontiers().
struct FrontierTask {
  static constexpr double kMaxViewRange = 500.0;  ///< Bound of view_range_m, in voxels.

  CellBox region = kAllCells;  ///< Frontier voxels outside are left out.
  std::size_t min_voxels = 1;  ///< Smaller frontiers are left out.
  /// So many of the largest frontiers are left out: an earlier answer has them.
  std::size_t first = 0;
  Eigen::Vector3d size_m =
      Eigen::Vector3d::Constant(0.5);  ///< Robot: a box that does not turn, > 0.
  double max_distance_m = 2.0;  ///< Maximum distance of a place to stand from its frontier, >= 0.
  /// Range of view from there: 0 (not computed) to kMaxViewRange voxels.
  double view_range_m = 2.0;
};

/// A cluster of free voxels beside unknown ones, in which each shares a face, an edge or a corner with another
/// one.
struct Frontier {
  std::vector<Cell> voxels;  ///< In the order of cells.
  /// Centre of the voxel that is nearest to the mean of all, metres.
  Eigen::Vector3d center_map = Eigen::Vector3d::Zero();
  /// The place nearest to the centre at which the robot meets neither an obstacle nor unknown space, as
  /// findNearestFit() finds it; nothing when there is none within max_distance_m.
  std::optional<Eigen::Vector3d> place_map;
  /// Volume of the unknown voxels visible from the place: their centres lie within the range, with no occupied
  /// voxel on the straight line. 0 without a place.
  double unknown_volume_m3 = 0.0;
};

/// Frontiers: the free voxels that share a face with an unknown one, in clusters, each with a
/// place to stand and the view from there (B. Yamauchi, 1997). The largest first.
///
/// Cases:
///   - the region is empty, or a number is outside its range: kInvalid;
///   - kBudgetSpent: the last ones are missing, see FrontierTask::first;
///   - others change the map meanwhile (MapUnlock): the clusters are of one revision, places and views may be of
///     later ones.
///
/// @param budget  Entries are frontiers.
/// @complexity O(bricks of the region, or all known bricks if these are fewer; frontier voxels); for each
/// frontier a findNearestFit(), and a ray to each unknown voxel in the range.
Answer<std::vector<Frontier>> findFrontiers(const CuboidMap& map, const FrontierTask& task,
                                            Budget& budget);

}  // namespace cuboid_mapping
