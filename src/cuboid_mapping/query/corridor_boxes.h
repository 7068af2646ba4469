// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/query/fit_field.h"

#include <Eigen/Core>

#include <vector>

namespace cuboid_mapping {

/// Converts a way of places to few maximal boxes.
class CorridorBoxes {
 public:
  CorridorBoxes(const Obstacles& obstacles, const FitField& field, const CellBox& region)
      : obstacles_(obstacles), field_(field), region_(region) {}

  /// @param start, goal  Voxels without obstacle that the first and the last box are to hold.
  /// @param way  Places from one to the other; the box of two successive ones has no obstacle.
  /// @return Once the budget of the obstacles is spent, boxes that are neither maximal nor few.
  [[nodiscard]] std::vector<CellBox> compute(const CellBox& start, const std::vector<Cell>& way,
                                             const CellBox& goal) const;

 private:
  [[nodiscard]] CellBox nextSlab(const CellBox& box, int face) const;
  [[nodiscard]] CellBox grow(CellBox box) const;
  void removeNeedless(std::vector<CellBox>& boxes, const CellBox& start, const CellBox& goal) const;

  const Obstacles& obstacles_;
  const FitField& field_;
  CellBox region_;
};

/// The overlap of successive boxes of a corridor.
struct CorridorPortals {
  std::vector<Eigen::Vector3d> centers_map;  ///< Metres.
  std::vector<MetricBox> ranges_map;  ///< Range of the robot's centre while it is in both boxes.
};

/// The overlaps of successive boxes. @param size  Edges of the robot, in voxels. @param clearance_m  Along x and
/// y: CorridorTask::clearance_m.
[[nodiscard]] CorridorPortals findPortals(const Grid& grid, const std::vector<CellBox>& boxes,
                                          const Cell& size, double clearance_m = 0.0);

/// A short path from start to goal with one point in each portal. @complexity O(portals).
[[nodiscard]] std::vector<Eigen::Vector3d> pullTight(const CorridorPortals& portals,
                                                     const Eigen::Vector3d& start_map,
                                                     const Eigen::Vector3d& goal_map);

}  // namespace cuboid_mapping
