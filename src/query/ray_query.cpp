// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/ray_query.h"

#include "cuboid_mapping/rtree/traversal.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cuboid_mapping {
namespace {

/// A stretch of a ray shorter than this is a touch, or a rounding error, in voxels.
constexpr double kTouch = 1e-9;
/// A ray that goes less per voxel of its length does not move along an axis.
constexpr double kStandstill = 1e-100;
constexpr double kNever = std::numeric_limits<double>::infinity();

/// Goes along a ray from voxel to voxel, or over a whole brick. Lengths are in voxels.
/// J. Amanatides and A. Woo, "A Fast Voxel Traversal Algorithm for Ray Tracing", 1987.
class VoxelWalk {
 public:
  /// @param origin, unit  In units of voxels. @param t_begin  Where the walk begins.
  VoxelWalk(const Eigen::Vector3d& origin, const Eigen::Vector3d& unit, double t_begin)
      : origin_(origin), unit_(unit), inverse_(unit.cwiseInverse()), t_enter_(t_begin) {
    for (int axis = 0; axis < 3; ++axis) {
      cell_[axis] = static_cast<std::int32_t>(std::floor(origin[axis] + t_begin * unit[axis]));
      step_[axis] = unit[axis] > kStandstill ? 1 : (unit[axis] < -kStandstill ? -1 : 0);
    }
    findExits();
  }

  [[nodiscard]] const Cell& cell() const { return cell_; }
  [[nodiscard]] double enter() const { return t_enter_; }
  [[nodiscard]] double leave() const { return t_exit_[exit_axis_]; }

  void stepOverVoxel() {
    t_enter_ = std::max(t_enter_, leave());
    cell_[exit_axis_] += step_[exit_axis_];
    t_exit_[exit_axis_] = exitOf(exit_axis_, cell_[exit_axis_]);
    findExitAxis();
  }

  /// Where the ray leaves the brick of the voxel.
  [[nodiscard]] double leaveBrick() const {
    double leave = kNever;
    for (int axis = 0; axis < 3; ++axis) leave = std::min(leave, exitOf(axis, lastInBrick(axis)));
    return leave;
  }

  void stepOverBrick() {
    const double t_leave = leaveBrick();
    for (int axis = 0; axis < 3; ++axis) {
      if (step_[axis] == 0) continue;
      const std::int32_t last = lastInBrick(axis);
      if (exitOf(axis, last) <= t_leave) {
        cell_[axis] = last + step_[axis];
        continue;
      }
      const auto reached =
          static_cast<std::int32_t>(std::floor(origin_[axis] + t_leave * unit_[axis]));
      cell_[axis] = step_[axis] > 0 ? std::clamp(reached, cell_[axis], last)
                                    : std::clamp(reached, last, cell_[axis]);
    }
    t_enter_ = std::max(t_enter_, t_leave);
    findExits();
  }

 private:
  /// Where the ray leaves the slab of a voxel along an axis.
  [[nodiscard]] double exitOf(int axis, std::int32_t cell) const {
    if (step_[axis] == 0) return kNever;
    return (cell + (step_[axis] > 0 ? 1 : 0) - origin_[axis]) * inverse_[axis];
  }
  [[nodiscard]] std::int32_t lastInBrick(int axis) const {
    return step_[axis] > 0 ? cell_[axis] | (kBrickEdge - 1) : cell_[axis] & ~(kBrickEdge - 1);
  }
  void findExits() {
    for (int axis = 0; axis < 3; ++axis) t_exit_[axis] = exitOf(axis, cell_[axis]);
    findExitAxis();
  }
  void findExitAxis() {
    exit_axis_ = t_exit_[0] <= t_exit_[1] ? 0 : 1;
    if (t_exit_[2] < t_exit_[exit_axis_]) exit_axis_ = 2;
  }

  Eigen::Vector3d origin_;
  Eigen::Vector3d unit_;
  Eigen::Vector3d inverse_;
  Cell cell_;
  int step_[3];
  double t_exit_[3];
  int exit_axis_ = 0;
  double t_enter_;
};

/// The part of a ray that can meet the map; empty when it does not.
traversal_detail::RayInterval clipToMap(const CuboidMap& map, const Eigen::Vector3d& origin,
                                        const Eigen::Vector3d& unit, double range) {
  const auto bounds = map.tree().bounds();
  if (!bounds) return {range, range};
  return traversal_detail::RaySearch(origin, unit, range).intersect(*bounds);
}

/// What a walk along a ray has found, in voxels.
struct RayWalkResult {
  RayEnd end = RayEnd::kMaxRange;
  double distance = 0.0;
  double unknown_length = 0.0;
  std::optional<double> first_unknown;
  Cell cell;  ///< The occupied voxel, if any.
};

RayWalkResult walk(const CuboidMap& map, const Eigen::Vector3d& origin, const Eigen::Vector3d& unit,
                   double range, UnknownPolicy policy) {
  RayWalkResult result;
  result.distance = range;
  const bool stops_at_unknown = policy == UnknownPolicy::kStop;
  const auto [begin, end] = clipToMap(map, origin, unit, range);
  // Adds a stretch of unknown space. Returns whether the ray ends there.
  const auto pass_unknown = [&](double enter, double leave) {
    const double length = std::min(leave, range) - enter;
    if (length <= kTouch) return false;
    result.unknown_length += length;
    if (!result.first_unknown) result.first_unknown = enter;
    if (!stops_at_unknown) return false;
    result.end = RayEnd::kUnknown;
    result.distance = enter;
    result.unknown_length = 0.0;
    return true;
  };
  if (pass_unknown(0.0, begin < end ? begin : range) || !(begin < end)) return result;
  VoxelWalk voxels(origin, unit, begin);
  while (voxels.enter() < end) {
    const Cell brick = brickOf(voxels.cell());
    VoxelClasses::Masks masks{};
    const bool is_known_brick = map.classes().find(brick, masks);
    if (!is_known_brick || masks.is_all_free) {
      if (!is_known_brick && pass_unknown(voxels.enter(), std::min(voxels.leaveBrick(), end))) {
        return result;
      }
      voxels.stepOverBrick();
      continue;
    }
    do {
      const double leave = std::min(voxels.leave(), end);
      const Occupancy occupancy = masks.at(voxelIndex(voxels.cell()));
      if (occupancy == Occupancy::kOccupied && leave - voxels.enter() > kTouch) {
        result.end = RayEnd::kOccupied;
        result.distance = voxels.enter();
        result.cell = voxels.cell();
        return result;
      }
      if (occupancy == Occupancy::kUnknown && pass_unknown(voxels.enter(), leave)) return result;
      voxels.stepOverVoxel();
    } while (brickOf(voxels.cell()) == brick && voxels.enter() < end);
  }
  pass_unknown(end, range);
  return result;
}

}  // namespace

std::optional<RayQueryResult> castRay(const CuboidMap& map, const Eigen::Vector3d& origin_map,
                                      const Eigen::Vector3d& direction, double max_range_m,
                                      UnknownPolicy policy) {
  if (!origin_map.allFinite() || !direction.allFinite() || !std::isfinite(max_range_m) ||
      max_range_m <= 0.0 || direction.isZero(0.0)) {
    return std::nullopt;
  }
  const Eigen::Vector3d unit = direction.stableNormalized();
  const Grid& grid = map.grid();
  const RayWalkResult walked =
      walk(map, grid.toCellUnits(origin_map), unit, max_range_m / grid.resolution(), policy);
  RayQueryResult result;
  result.end = walked.end;
  if (walked.end == RayEnd::kOccupied) result.voxel = walked.cell;
  result.distance_m = walked.distance * grid.resolution();
  result.unknown_length_m = walked.unknown_length * grid.resolution();
  if (walked.first_unknown) result.first_unknown_m = *walked.first_unknown * grid.resolution();
  result.point_map = origin_map + result.distance_m * unit;
  return result;
}

}  // namespace cuboid_mapping
