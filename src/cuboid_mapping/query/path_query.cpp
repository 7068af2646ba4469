// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/path_query.h"

#include "cuboid_mapping/query/obstacles.h"

#include <algorithm>
#include <cmath>

namespace cuboid_mapping {
namespace {

/// Overlap in voxels that is none; that of Grid::toCellBox.
constexpr double kTouch = 1e-6;
/// Length of the pieces of a segment, in voxels; an edge of the box, if that is more.
constexpr double kPieceLength = 16.0;

/// A straight motion of a box; all lengths in voxels.
struct Sweep {
  Eigen::Vector3d from;
  Eigen::Vector3d to;
  Eigen::Vector3d half;  ///< Half the edges of the box.

  [[nodiscard]] Eigen::Vector3d at(double t) const { return from + t * (to - from); }

  /// Part of the motion, from 0 to 1, at which the box meets a voxel first; infinity for never.
  [[nodiscard]] double findContact(const Cell& voxel) const {
    double enter = 0.0;
    double leave = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
      const double lower = voxel[axis] - half[axis] + kTouch - from[axis];
      const double upper = voxel[axis] + 1.0 + half[axis] - kTouch - from[axis];
      const double motion = to[axis] - from[axis];
      if (motion == 0.0) {
        if (lower >= 0.0 || upper <= 0.0) return std::numeric_limits<double>::infinity();
        continue;
      }
      const double t_lower = lower / motion;
      const double t_upper = upper / motion;
      enter = std::max(enter, std::min(t_lower, t_upper));
      leave = std::min(leave, std::max(t_lower, t_upper));
    }
    return enter < leave ? enter : std::numeric_limits<double>::infinity();
  }

  /// All voxels that the box can meet in a part of the motion.
  [[nodiscard]] CellBox bounds(double t_first, double t_last) const {
    CellBox box;
    const Eigen::Vector3d a = at(t_first);
    const Eigen::Vector3d b = at(t_last);
    for (int axis = 0; axis < 3; ++axis) {
      const double lower = std::min(a[axis], b[axis]) - half[axis];
      const double upper = std::max(a[axis], b[axis]) + half[axis];
      box.min[axis] = static_cast<std::int32_t>(std::floor(lower + kTouch));
      box.max[axis] = std::max(box.min[axis] + 1, static_cast<std::int32_t>(std::ceil(upper)));
    }
    return box;
  }
};

struct Contact {
  double t;
  Cell voxel;
};

std::optional<Contact> findFirst(const Obstacles& obstacles, const Sweep& sweep) {
  const double length = (sweep.to - sweep.from).cwiseAbs().maxCoeff();
  const double piece = std::max(kPieceLength, 2.0 * sweep.half.maxCoeff());
  const double num_pieces = std::max(1.0, std::ceil(length / piece));
  std::optional<Contact> first;
  for (double i = 0.0; i < num_pieces && !first && !obstacles.budget().isSpent(); ++i) {
    const double t_last = i + 1.0 < num_pieces ? (i + 1.0) / num_pieces : 1.0;
    const CellBox bounds = sweep.bounds(i / num_pieces, t_last);
    if (!obstacles.isAny(bounds)) continue;
    obstacles.visit(bounds, [&](const Cell& voxel) {
      const double t = sweep.findContact(voxel);
      if (t <= t_last && (!first || t < first->t)) first = Contact{t, voxel};
    });
  }
  return first;
}

bool isValid(const Grid& grid, const std::vector<Eigen::Vector3d>& waypoints_map,
             const Eigen::Vector3d& size_m) {
  if (waypoints_map.empty() || !(size_m.array() > 0.0).all()) return false;
  return std::all_of(waypoints_map.begin(), waypoints_map.end(), [&](const auto& waypoint) {
    return grid.toCellBox(boxAround(waypoint, size_m)).has_value();
  });
}

}  // namespace

PathQueryResult checkPath(const CuboidMap& map, const std::vector<Eigen::Vector3d>& waypoints_map,
                          const Eigen::Vector3d& size_m, UnknownPolicy policy, Budget& budget) {
  const Grid& grid = map.grid();
  if (!isValid(grid, waypoints_map, size_m)) return {};
  const Obstacles obstacles(map, policy, budget);
  PathQueryResult result;
  const std::size_t num_segments = std::max<std::size_t>(1, waypoints_map.size() - 1);
  for (std::size_t i = 0; i < num_segments; ++i) {
    const Eigen::Vector3d& from = waypoints_map[i];
    const Eigen::Vector3d& to = waypoints_map[std::min(i + 1, waypoints_map.size() - 1)];
    const double length_m = (to - from).norm();
    if (!result.contact) {
      const Sweep sweep{grid.toCellUnits(from), grid.toCellUnits(to),
                        0.5 * grid.toCellUnits(size_m)};
      if (const auto first = findFirst(obstacles, sweep)) {
        result.contact = {i, result.length_m + first->t * length_m, from + first->t * (to - from),
                          first->voxel};
      }
    }
    result.length_m += length_m;
    if (budget.isSpent()) return {WayAnswer::kBudgetSpent, 0.0, std::nullopt};
  }
  result.answer = result.contact ? WayAnswer::kBlocked : WayAnswer::kFree;
  return result;
}

}  // namespace cuboid_mapping
