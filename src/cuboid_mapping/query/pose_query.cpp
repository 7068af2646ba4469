// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/pose_query.h"

#include "cuboid_mapping/query/obstacles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

namespace cuboid_mapping {
namespace {

/// Overlap in voxels that is none; that of Grid::toCellBox.
constexpr double kNoOverlap = 1e-6;

/// std::floor() without a call, to 2^-22. @pre The value lies in the range of cells.
std::int32_t floorToInt(double value) {
  constexpr double kOffset = 2147483648.0;
  return static_cast<std::int32_t>(static_cast<std::int64_t>(value + kOffset) -
                                   static_cast<std::int64_t>(kOffset));
}

/// The cells that may overlap what reaches so far from a centre by more than kNoOverlap, and some beyond; all lengths in
/// voxels.
CellBox cellsAround(const Eigen::Vector3d& center, const Eigen::Vector3d& reach) {
  constexpr double kSure = 0.5 * kNoOverlap;
  CellBox box;
  for (int axis = 0; axis < 3; ++axis) {
    box.min[axis] = floorToInt(center[axis] - reach[axis] + kSure);
    box.max[axis] = floorToInt(center[axis] + reach[axis] - kSure) + 1;
  }
  return box;
}

/// A cube of the grid, a voxel or a brick.
struct Cube {
  Eigen::Vector3d center;
  double half;  ///< Half of an edge.

  static Cube of(const Cell& least, double edge) {
    return {toVector(least).array() + 0.5 * edge, 0.5 * edge};
  }
};

/// A ball; all lengths in voxels.
class Ball {
 public:
  Ball(const Eigen::Vector3d& center, double radius)
      : center_(center),
        square_((radius - kNoOverlap) * (radius - kNoOverlap)),
        bounds_(cellsAround(center, Eigen::Vector3d::Constant(radius))) {}

  [[nodiscard]] const CellBox& bounds() const { return bounds_; }
  [[nodiscard]] bool meets(const Cube& cube) const {
    const Eigen::Array3d away = (center_ - cube.center).array().abs() - cube.half;
    return away.max(0.0).square().sum() < square_;
  }

 private:
  Eigen::Vector3d center_;
  double square_;
  CellBox bounds_;
};

/// A box that is turned; all lengths in voxels.
class TurnedBox {
 public:
  /// @param turn  Columns: directions of the edges.
  TurnedBox(const Eigen::Vector3d& center, const Eigen::Matrix3d& turn, const Eigen::Vector3d& half)
      : center_(center), bounds_(cellsAround(center, turn.cwiseAbs() * half)) {
    const auto add = [&](const Eigen::Vector3d& axis) {
      // Edges that are parallel: the other axes tell.
      constexpr double kParallel = 1e-6;
      const double length = axis.norm();
      if (length < kParallel) return;
      const Eigen::Vector3d normal = axis / length;
      axes_[num_axes_++] = {normal, (turn.transpose() * normal).cwiseAbs().dot(half),
                            normal.cwiseAbs().sum()};
    };
    for (int i = 0; i < 3; ++i) add(Eigen::Vector3d::Unit(i));
    for (int i = 0; i < 3; ++i) add(turn.col(i));
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) add(Eigen::Vector3d::Unit(i).cross(turn.col(k)));
    }
  }

  [[nodiscard]] const CellBox& bounds() const { return bounds_; }
  [[nodiscard]] bool meets(const Cube& cube) const {
    const Eigen::Vector3d apart = cube.center - center_;
    return std::all_of(axes_.begin(), axes_.begin() + num_axes_, [&](const Axis& axis) {
      return std::abs(axis.normal.dot(apart)) <
             axis.reach + cube.half * axis.reach_of_cube - kNoOverlap;
    });
  }

 private:
  /// On which the two may not overlap.
  struct Axis {
    Eigen::Vector3d normal;
    double reach;          ///< Distance from the box's centre to a corner.
    double reach_of_cube;  ///< The same, of a cube whose edges are 2 long.
  };

  Eigen::Vector3d center_;
  CellBox bounds_;
  std::array<Axis, 15> axes_;
  std::ptrdiff_t num_axes_ = 0;
};

/// The obstacles of bricks, of which those that lie together are looked up once.
class ObstacleCache {
 public:
  ObstacleCache(const CuboidMap& map, UnknownPolicy policy, Budget& budget)
      : obstacles_(map, policy, budget) {
    slots_.fill({kNoBrick, kNothing});
    masks_.reserve(64);
  }

  [[nodiscard]] Budget& budget() const { return obstacles_.budget(); }

  /// The voxels of a brick that are in the way; null: none. Valid until the next call. When the budget is spent,
  /// anything.
  [[nodiscard]] const BrickMask* find(const Cell& brick) {
    Slot& slot = slots_[static_cast<std::size_t>((brick.x >> 3 & 7) | (brick.y >> 3 & 7) << 3 |
                                                 (brick.z >> 3 & 3) << 6)];
    if (slot.brick != brick) look(brick, slot);
    return slot.mask == kNothing ? nullptr : &masks_[slot.mask];
  }

 private:
  struct Slot {
    Cell brick;
    std::uint32_t mask;  ///< Number, or kNothing.
  };
  static constexpr std::size_t kNumSlots = 256;
  static constexpr std::size_t kMaxMasks = 1024;
  static constexpr std::uint32_t kNothing = 0xFFFFFFFFU;
  static constexpr Cell kNoBrick{1, 1, 1};

  void look(const Cell& brick, Slot& slot) {
    if (!budget().spend()) return;
    if (masks_.size() == kMaxMasks) {
      slots_.fill({kNoBrick, kNothing});
      masks_.clear();
    }
    const BrickMask mask = obstacles_.inBrick(brick);
    slot = {brick, kNothing};
    if (mask.isEmpty()) return;
    slot.mask = static_cast<std::uint32_t>(masks_.size());
    masks_.push_back(mask);
  }

  Obstacles obstacles_;
  std::array<Slot, kNumSlots> slots_;
  std::vector<BrickMask> masks_;
};

/// An obstacle that a shape meets in one brick.
template <typename ShapeT>
std::optional<Cell> findMet(const ShapeT& shape, const Cell& brick, const BrickMask& obstacles) {
  if (!shape.meets(Cube::of(brick, kBrickEdge))) return std::nullopt;
  const CellBox part = intersect(shape.bounds(), brickBox(brick));
  CellBox slice = part;
  slice.max.z = slice.min.z + 1;
  const std::uint64_t columns = BrickMask::ofBox(slice)[slice.min.z - brick.z];
  for (std::int32_t z = part.min.z; z < part.max.z; ++z) {
    for (std::uint64_t left = obstacles[z - brick.z] & columns; left != 0; left &= left - 1) {
      const int column = __builtin_ctzll(left);
      const Cell voxel{brick.x + column % kBrickEdge, brick.y + column / kBrickEdge, z};
      if (shape.meets(Cube::of(voxel, 1.0))) return voxel;
    }
  }
  return std::nullopt;
}

/// An obstacle that a shape meets; nothing when the budget is spent.
template <typename ShapeT>
std::optional<Cell> findMet(const ShapeT& shape, ObstacleCache& cache) {
  const Cell first = brickOf(shape.bounds().min);
  const Cell& end = shape.bounds().max;
  Cell brick;
  for (brick.z = first.z; brick.z < end.z; brick.z += kBrickEdge) {
    for (brick.y = first.y; brick.y < end.y; brick.y += kBrickEdge) {
      for (brick.x = first.x; brick.x < end.x; brick.x += kBrickEdge) {
        const BrickMask* obstacles = cache.find(brick);
        if (cache.budget().isSpent()) return std::nullopt;
        if (obstacles == nullptr) continue;
        if (const auto met = findMet(shape, brick, *obstacles)) return met;
      }
    }
  }
  return std::nullopt;
}

/// @param contact  Is set when there is one. @return Whether there is.
bool findContact(const Body& body, const Eigen::Isometry3d& T_map_body, const Grid& grid,
                 ObstacleCache& cache, std::optional<PoseContact>& contact) {
  std::size_t part = 0;
  const auto is_met = [&](const auto& shape) {
    const auto voxel = findMet(shape, cache);
    if (voxel) contact = PoseContact{part, *voxel};
    ++part;
    return voxel.has_value();
  };
  for (const BodySphere& sphere : body.spheres) {
    const Eigen::Vector3d center_map =
        T_map_body.linear() * sphere.center_body + T_map_body.translation();
    if (is_met(Ball(grid.toCellUnits(center_map), sphere.radius_m * grid.inverseResolution()))) {
      return true;
    }
  }
  for (const BodyBox& box : body.boxes) {
    const Eigen::Isometry3d T_map_box = T_map_body * box.T_body_box;
    if (is_met(TurnedBox(grid.toCellUnits(T_map_box.translation()), T_map_box.linear(),
                         0.5 * grid.toCellUnits(box.size_m)))) {
      return true;
    }
  }
  return false;
}

/// Also false with NaN.
bool isRotation(const Eigen::Matrix3d& turn) {
  constexpr double kTolerance = 1e-6;
  const Eigen::Vector3d x = turn.col(0);
  const Eigen::Vector3d y = turn.col(1);
  return std::abs(x.squaredNorm() - 1.0) < kTolerance &&
         std::abs(y.squaredNorm() - 1.0) < kTolerance && std::abs(x.dot(y)) < kTolerance &&
         (x.cross(y) - turn.col(2)).squaredNorm() < kTolerance * kTolerance;
}

/// How far a part reaches from the origin of its body.
///@{
double reachOf(const BodySphere& sphere) { return sphere.center_body.norm() + sphere.radius_m; }
double reachOf(const BodyBox& box) {
  return box.T_body_box.translation().norm() + 0.5 * box.size_m.norm();
}
///@}

/// Why a part is none; its size and its reach.
std::string findFault(double size_m, double reach_m, const Grid& grid) {
  const double min_m = Body::kMinSize * grid.resolution();
  const double max_m = Body::kMaxReach * grid.resolution();
  if (size_m >= min_m && reach_m <= max_m) return {};
  std::ostringstream text;
  if (!std::isfinite(reach_m) || !(size_m >= min_m)) {
    text << "radii and edges must be numbers of at least " << min_m << " m, and places finite";
  } else {
    text << "it reaches " << reach_m << " m from the origin of the body: at most " << max_m
         << " m (4096 voxels); give the body in metres, or in parts";
  }
  return text.str();
}

}  // namespace

double reachOf(const Body& body) {
  double reach_m = 0.0;
  for (const BodySphere& sphere : body.spheres) reach_m = std::max(reach_m, reachOf(sphere));
  for (const BodyBox& box : body.boxes) reach_m = std::max(reach_m, reachOf(box));
  return reach_m;
}

std::string findFault(const Body& body, const Grid& grid) {
  if (body.spheres.empty() && body.boxes.empty()) {
    return "the body has no part: give it a sphere or a box";
  }
  const auto name = [](const char* parts, const auto& all, const auto& part) {
    return std::string(parts) + '[' + std::to_string(&part - all.data()) + "]: ";
  };
  for (const BodySphere& sphere : body.spheres) {
    const std::string fault = findFault(sphere.radius_m, reachOf(sphere), grid);
    if (!fault.empty()) return name("spheres", body.spheres, sphere) + fault;
  }
  for (const BodyBox& box : body.boxes) {
    std::string fault = findFault(box.size_m.minCoeff(), reachOf(box), grid);
    if (fault.empty() && !isRotation(box.T_body_box.linear())) {
      fault = "its orientation is no rotation: normalize the quaternion";
    }
    if (!fault.empty()) return name("boxes", body.boxes, box) + fault;
  }
  return {};
}

std::vector<PoseQueryResult> checkPoses(const CuboidMap& map, const Body& body,
                                        const std::vector<Eigen::Isometry3d>& T_map_body,
                                        UnknownPolicy policy, Budget& budget) {
  std::vector<PoseQueryResult> results(T_map_body.size());
  const Grid& grid = map.grid();
  if (!findFault(body, grid).empty()) return results;
  const double max_m = (Grid::kMaxCell - 1) * grid.resolution() - reachOf(body);
  ObstacleCache cache(map, policy, budget);
  for (std::size_t i = 0; i < results.size(); ++i) {
    PoseQueryResult& result = results[i];
    const Eigen::Isometry3d& pose = T_map_body[i];
    const bool is_inside = (pose.translation().array().abs() <= max_m).all();  // NaN: false.
    if (!is_inside || !isRotation(pose.linear())) continue;
    if (!budget.isSpent() && findContact(body, pose, grid, cache, result.contact)) {
      result.answer = WayAnswer::kBlocked;
    } else {
      result.answer = budget.isSpent() ? WayAnswer::kBudgetSpent : WayAnswer::kFree;
    }
  }
  return results;
}

}  // namespace cuboid_mapping
