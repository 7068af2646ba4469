// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/ray_query.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cuboid_mapping {
namespace {

/// Shorter stretches of a ray do not count: they are touches or rounding errors. In voxels.
constexpr double kNoStretch = 1e-9;
/// A ray with a smaller component of its unit vector does not move along that axis.
constexpr double kStandstill = 1e-100;
constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr char kNoRay[] =
    "origin and direction must be finite, the direction not zero, and max_range > 0";

/// Walks along a ray from voxel to voxel, or over a whole brick. Lengths are in voxels.
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

  /// Length at which the ray leaves the brick of the voxel.
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
  /// Length at which the ray leaves the slab of a voxel along an axis.
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

/// Part of a ray, in voxels from its origin; empty when first > last.
struct RayInterval {
  double first;
  double last;
};

/// The part of a ray that can meet the map; empty when it does not.
RayInterval clipToMap(const CuboidMap& map, const Eigen::Vector3d& origin,
                      const Eigen::Vector3d& unit, double range) {
  const std::optional<CellBox> bounds = map.bounds();
  if (!bounds) return {range, range};
  RayInterval interval{0.0, range};
  for (int axis = 0; axis < 3; ++axis) {
    const double lower = bounds->min[axis] - origin[axis];
    const double upper = bounds->max[axis] - origin[axis];
    if (unit[axis] == 0.0) {
      if (lower > 0.0 || upper <= 0.0) return {range, range};
      continue;
    }
    const double t_lower = lower / unit[axis];
    const double t_upper = upper / unit[axis];
    interval.first = std::max(interval.first, std::min(t_lower, t_upper));
    interval.last = std::min(interval.last, std::max(t_lower, t_upper));
  }
  return interval;
}

/// The unknown space that a ray meets. Lengths are in voxels.
class UnknownMeter {
 public:
  static constexpr bool kIsAsked = true;
  UnknownMeter(double range, UnknownPolicy policy) : range_(range), policy_(policy) {}

  /// Adds a stretch of unknown space. @return Whether the ray ends at its begin.
  bool pass(double enter, double leave) {
    const double stretch = std::min(leave, range_) - enter;
    if (stretch <= kNoStretch) return false;
    if (!first_) first_ = enter;
    if (policy_ == UnknownPolicy::kObstacle) {
      is_stopped_ = true;
      return true;
    }
    length_ += stretch;
    return false;
  }

  [[nodiscard]] bool isStopped() const { return is_stopped_; }
  [[nodiscard]] double length() const { return length_; }
  /// Start of the first stretch.
  [[nodiscard]] const std::optional<double>& first() const { return first_; }

 private:
  double range_;
  UnknownPolicy policy_;
  bool is_stopped_ = false;
  double length_ = 0.0;
  std::optional<double> first_;
};

/// For rays that only look for occupied voxels.
struct UnknownIgnored {
  static constexpr bool kIsAsked = false;
  static bool pass(double /*enter*/, double /*leave*/) { return false; }
};

/// The occupied voxel that a ray hits.
struct VoxelHit {
  Cell voxel;
  double distance;  ///< In voxels.
};

/// Walks along a ray until something is in the way.
template <typename UnknownT>
std::optional<VoxelHit> walk(const CuboidMap& map, const Eigen::Vector3d& origin,
                             const Eigen::Vector3d& unit, double range, UnknownT& unknown,
                             Budget& budget) {
  const auto [begin, end] = clipToMap(map, origin, unit, range);
  if (unknown.pass(0.0, begin < end ? begin : range) || !(begin < end)) return std::nullopt;
  VoxelWalk voxels(origin, unit, begin);
  while (voxels.enter() < end && budget.spendAndUnlock()) {
    const Cell brick = brickOf(voxels.cell());
    const PackedVoxels* found = map.voxels().find(brick);
    if (found == nullptr || (UnknownT::kIsAsked ? found->isAllFree() : !found->isAnyOccupied())) {
      if (found == nullptr && unknown.pass(voxels.enter(), std::min(voxels.leaveBrick(), end))) {
        return std::nullopt;
      }
      voxels.stepOverBrick();
      continue;
    }
    const BrickMask occupied = found->occupied();
    const BrickMask known = UnknownT::kIsAsked ? found->known() : BrickMask();
    do {
      const double leave = std::min(voxels.leave(), end);
      const int voxel = voxelIndex(voxels.cell());
      if (occupied.test(voxel) && leave - voxels.enter() > kNoStretch) {
        return VoxelHit{voxels.cell(), voxels.enter()};
      }
      if (UnknownT::kIsAsked && !known.test(voxel) && unknown.pass(voxels.enter(), leave)) {
        return std::nullopt;
      }
      voxels.stepOverVoxel();
    } while (brickOf(voxels.cell()) == brick && voxels.enter() < end);
  }
  unknown.pass(end, range);
  return std::nullopt;
}

bool isRay(const Eigen::Vector3d& origin_map, const Eigen::Vector3d& direction,
           double max_range_m) {
  return origin_map.allFinite() && direction.allFinite() && std::isfinite(max_range_m) &&
         max_range_m > 0.0 && !direction.isZero(0.0);
}

}  // namespace

Answer<RayQueryResult> castRay(const CuboidMap& map, const Eigen::Vector3d& origin_map,
                               const Eigen::Vector3d& direction, double max_range_m,
                               UnknownPolicy policy, Budget& budget) {
  if (!isRay(origin_map, direction, max_range_m)) return Answer<RayQueryResult>::invalid(kNoRay);
  const Eigen::Vector3d unit = direction.stableNormalized();
  const Grid& grid = map.grid();
  const double range = max_range_m / grid.resolution();
  UnknownMeter unknown(range, policy);
  const auto hit = walk(map, grid.toCellUnits(origin_map), unit, range, unknown, budget);
  if (budget.isSpent()) return AnswerStatus::kBudgetSpent;
  RayQueryResult result;
  result.distance_m = max_range_m;
  if (hit) {
    result.end = RayEnd::kOccupied;
    result.voxel = hit->voxel;
    result.distance_m = hit->distance * grid.resolution();
  } else if (unknown.isStopped()) {
    result.end = RayEnd::kUnknown;
    result.distance_m = *unknown.first() * grid.resolution();
  }
  result.unknown_length_m = unknown.length() * grid.resolution();
  if (unknown.first()) result.first_unknown_m = *unknown.first() * grid.resolution();
  result.point_map = origin_map + result.distance_m * unit;
  return result;
}

Answer<RayHit> findFirstHit(const CuboidMap& map, const Eigen::Vector3d& origin_map,
                            const Eigen::Vector3d& direction, double max_range_m, Budget& budget) {
  if (!isRay(origin_map, direction, max_range_m)) return Answer<RayHit>::invalid(kNoRay);
  const Eigen::Vector3d unit = direction.stableNormalized();
  const Grid& grid = map.grid();
  UnknownIgnored unknown;
  const auto hit = walk(map, grid.toCellUnits(origin_map), unit, max_range_m / grid.resolution(),
                        unknown, budget);
  if (!hit) return budget.isSpent() ? AnswerStatus::kBudgetSpent : AnswerStatus::kNotFound;
  const double distance_m = hit->distance * grid.resolution();
  return RayHit{hit->voxel, distance_m, origin_map + distance_m * unit};
}

}  // namespace cuboid_mapping
