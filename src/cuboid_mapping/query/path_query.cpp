// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/path_query.h"

#include "cuboid_mapping/query/body_shapes.h"
#include "cuboid_mapping/query/obstacles.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

namespace cuboid_mapping {
namespace {

/// A part of a motion, from 0 to 1.
struct Part {
  double enter = 0.0;
  double leave = 1.0;

  [[nodiscard]] bool isEmpty() const { return !(enter < leave); }
};

/// A straight motion of a box; all lengths in voxels.
struct Sweep {
  Eigen::Vector3d from;
  Eigen::Vector3d motion;
  Eigen::Vector3d half;  ///< Half the edges of the box.

  [[nodiscard]] Eigen::Vector3d at(double t) const { return from + t * motion; }

  /// The part of `part` in which the box overlaps a slab of space.
  [[nodiscard]] Part clip(const Part& part, int axis, double low, double high) const {
    const double lower = low - half[axis] + kNoOverlap - from[axis];
    const double upper = high + half[axis] - kNoOverlap - from[axis];
    if (motion[axis] == 0.0) return lower < 0.0 && upper > 0.0 ? part : Part{1.0, 0.0};
    const double t_lower = lower / motion[axis];
    const double t_upper = upper / motion[axis];
    return {std::max(part.enter, std::min(t_lower, t_upper)),
            std::min(part.leave, std::max(t_lower, t_upper))};
  }

  /// The part of the motion in which the box meets a voxel.
  [[nodiscard]] Part findContact(const Cell& voxel) const {
    Part part;
    for (int axis = 0; axis < 3; ++axis) part = clip(part, axis, voxel[axis], voxel[axis] + 1.0);
    return part;
  }

  /// A box that contains all voxels that the moving box can meet in a part of the motion.
  [[nodiscard]] CellBox bounds(const Part& part) const {
    const Eigen::Vector3d a = at(part.enter);
    const Eigen::Vector3d b = at(part.leave);
    const Eigen::Vector3d reach = half.array() + kNoOverlap;
    CellBox box;
    for (int axis = 0; axis < 3; ++axis) {
      const double lower = std::min(a[axis], b[axis]) - reach[axis];
      const double upper = std::max(a[axis], b[axis]) + reach[axis];
      box.min[axis] = static_cast<std::int32_t>(std::floor(lower));
      box.max[axis] = static_cast<std::int32_t>(std::floor(upper)) + 1;
    }
    return box;
  }
};

/// The bricks that a box meets on its way, slab by slab along the motion.
class SweptBricks {
 public:
  explicit SweptBricks(const Sweep& sweep) : sweep_(sweep) {
    sweep.motion.cwiseAbs().maxCoeff(&main_axis_);
  }

  /// Visits the bricks. @param visit  (const Cell& brick, const Part&) -> double: gets the part in which the
  /// box meets the brick, and returns the end of the part still to be visited; less than 0 ends the visit.
  template <typename VisitorT>
  void visit(const VisitorT& visit) {
    visitSlabs(0, Cell(), Part(), visit);
  }

 private:
  template <typename VisitorT>
  void visitSlabs(int depth, Cell brick, const Part& part, const VisitorT& visit) {
    const int axis = (main_axis_ + depth) % 3;
    const CellBox bounds = sweep_.bounds(part);
    const Cell first = brickOf(bounds.min);
    const std::int32_t last = (bounds.max[axis] - 1) & ~(kBrickEdge - 1);
    const bool is_forward = sweep_.motion[axis] >= 0.0;
    for (std::int32_t from = 0; from <= last - first[axis]; from += kBrickEdge) {
      brick[axis] = is_forward ? first[axis] + from : last - from;
      const Part inside = sweep_.clip(part, axis, brick[axis], brick[axis] + 1.0 * kBrickEdge);
      if (inside.isEmpty()) continue;
      if (inside.enter >= until_) return;  // All later slabs begin later, too.
      if (depth < 2) {
        visitSlabs(depth + 1, brick, inside, visit);
      } else {
        until_ = visit(brick, inside);
      }
    }
  }

  const Sweep& sweep_;
  Eigen::Index main_axis_ = 0;
  double until_ = 1.0;
};

struct Contact {
  double t;
  Cell voxel;
};

enum class Wanted : unsigned char { kFirst, kAny };

/// A contact of a motion; nothing if there is none, or when the budget is spent.
std::optional<Contact> findContact(const Obstacles& obstacles, const Sweep& sweep, Wanted wanted) {
  std::optional<Contact> found;
  constexpr double kEnd = -1.0;
  SweptBricks(sweep).visit([&](const Cell& brick, const Part& part) {
    if (!obstacles.budget().spendAndUnlock()) return kEnd;
    BrickMask near = obstacles.inBrick(brick);
    const CellBox bounds = intersect(sweep.bounds(part), brickBox(brick));
    if (!near.isEmpty() && !bounds.isEmpty()) {
      near &= BrickMask::ofBox(bounds);
      forEachCell(brick, near, [&](const Cell& voxel) {
        const Part contact = sweep.findContact(voxel);
        if (contact.isEmpty() || (found && found->t <= contact.enter)) return;
        found = Contact{contact.enter, voxel};
      });
    }
    if (!found) return 1.0;
    return wanted == Wanted::kAny ? kEnd : found->t;
  });
  return found;
}

bool isValid(const Grid& grid, const std::vector<Eigen::Vector3d>& waypoints_map,
             const Eigen::Vector3d& size_m) {
  if (waypoints_map.empty() || !(size_m.array() > 0.0).all()) return false;
  return std::all_of(waypoints_map.begin(), waypoints_map.end(), [&](const auto& waypoint) {
    return grid.toCellBox(boxAround(waypoint, size_m)).has_value();
  });
}

Sweep makeSweep(const Grid& grid, const Eigen::Vector3d& from_map, const Eigen::Vector3d& to_map,
                const Eigen::Vector3d& size_m) {
  const Eigen::Vector3d from = grid.toCellUnits(from_map);
  return {from, grid.toCellUnits(to_map) - from, 0.5 * grid.toCellUnits(size_m)};
}

/// As checkPath(): the first contact, or any.
Answer<PathContact> check(const Obstacles& obstacles, const Grid& grid,
                          const std::vector<Eigen::Vector3d>& waypoints_map,
                          const Eigen::Vector3d& size_m, Wanted wanted) {
  if (!isValid(grid, waypoints_map, size_m)) {
    return Answer<PathContact>::invalid(
        "there must be a waypoint, all finite and within the range of the grid, and edges > 0");
  }
  double length_m = 0.0;
  const std::size_t num_segments = std::max<std::size_t>(1, waypoints_map.size() - 1);
  for (std::size_t i = 0; i < num_segments; ++i) {
    const Eigen::Vector3d& from = waypoints_map[i];
    const Eigen::Vector3d& to = waypoints_map[std::min(i + 1, waypoints_map.size() - 1)];
    const Eigen::Vector3d motion = to - from;
    const auto met = findContact(obstacles, makeSweep(grid, from, to, size_m), wanted);
    if (obstacles.budget().isSpent()) return AnswerStatus::kBudgetSpent;
    if (met) {
      return PathContact{i, length_m + met->t * motion.norm(), from + met->t * motion, met->voxel};
    }
    length_m += motion.norm();
  }
  return AnswerStatus::kNotFound;
}

}  // namespace

Answer<PathContact> checkPath(const CuboidMap& map,
                              const std::vector<Eigen::Vector3d>& waypoints_map,
                              const Eigen::Vector3d& size_m, UnknownPolicy policy, Budget& budget) {
  return check(Obstacles(map, policy, budget), map.grid(), waypoints_map, size_m, Wanted::kFirst);
}

bool isPathFree(const CuboidMap& map, const std::vector<Eigen::Vector3d>& waypoints_map,
                const Eigen::Vector3d& size_m, UnknownPolicy policy, Budget& budget) {
  const Obstacles obstacles(map, policy, budget);
  return check(obstacles, map.grid(), waypoints_map, size_m, Wanted::kAny).isNotFound();
}

double lengthOf(const std::vector<Eigen::Vector3d>& waypoints_map) {
  double length_m = 0.0;
  for (std::size_t i = 1; i < waypoints_map.size(); ++i) {
    length_m += (waypoints_map[i] - waypoints_map[i - 1]).norm();
  }
  return length_m;
}

}  // namespace cuboid_mapping
